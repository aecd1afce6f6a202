#include "server/scene/merge_match.h"

#include <functional>
#include <map>
#include <string>
#include <utility>

namespace gonio {
namespace {

using KeyOf = std::function<std::string(const ImportedLight&)>;  // empty: it has none

class Matching {
public:
    Matching(const Imported& was, const Imported& now)
        : was_(was), now_(now), taken_(was.lights.size(), false), matches_(now.lights.size()) {}

    // Several may have the same key. Then they are paired in order, or, where a key must be unique, not at all.
    void by_key(MatchedBy by, bool alone, const KeyOf& key_of) {
        std::map<std::string, std::vector<std::size_t>> before, after;
        for (std::size_t i = 0; i < taken_.size(); ++i)
            if (!taken_[i]) before[key_of(was_.lights[i])].push_back(i);
        for (std::size_t i = 0; i < matches_.size(); ++i)
            if (matches_[i].was < 0) after[key_of(now_.lights[i])].push_back(i);
        for (const auto& [key, fresh] : after) {
            const auto found = before.find(key);
            if (key.empty() || found == before.end()) continue;
            if (alone && (fresh.size() > 1 || found->second.size() > 1)) continue;
            for (std::size_t i = 0; i < fresh.size() && i < found->second.size(); ++i)
                take(found->second[i], fresh[i], by);
        }
    }
    void by_place() {
        std::multimap<std::string, std::size_t> before;
        for (std::size_t i = 0; i < taken_.size(); ++i)
            if (!taken_[i]) before.emplace(was_.lights[i].name, i);
        for (std::size_t i = 0; i < matches_.size(); ++i) {
            if (matches_[i].was >= 0) continue;
            const ImportedLight& light = now_.lights[i];
            const auto [first, last] = before.equal_range(light.name);
            for (auto one = first; one != last; ++one) {
                if (taken_[one->second]) continue;
                if (!(glm::distance(was_.lights[one->second].position, light.position) <= kMostDrift_m)) continue;
                take(one->second, i, MatchedBy::place);
                break;
            }
        }
    }
    std::vector<Match> result() { return std::move(matches_); }

private:
    void take(std::size_t was, std::size_t now, MatchedBy by) {
        taken_[was] = true;
        matches_[now] = {static_cast<int>(was), by};
    }
    const Imported &was_, &now_;
    std::vector<bool> taken_;
    std::vector<Match> matches_;
};

}  // namespace

std::vector<Match> match_lights(const Imported& was, const Imported& now) {
    Matching matching(was, now);
    matching.by_key(MatchedBy::uuid, false, [](const ImportedLight& light) {
        return light.uuid.empty() ? "" : light.uuid + '\n' + light.beam;
    });
    // In another mode a fixture may have other beams.
    matching.by_key(MatchedBy::uuid, false, [](const ImportedLight& light) { return light.uuid; });
    matching.by_key(MatchedBy::number, true, [](const ImportedLight& light) {
        const bool none = light.number.empty() || light.number == "0";
        return none ? "" : light.number + '\n' + light.type + '\n' + light.beam;
    });
    matching.by_place();
    return matching.result();
}

}  // namespace gonio
