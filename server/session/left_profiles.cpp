#include "server/session/left_profiles.h"

#include <algorithm>
#include <set>

#include "server/scene/cue.h"
#include "server/scene/light_tables.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

using Profiles = std::set<std::shared_ptr<const Profile>>;

template <typename Lights>
void add(const Lights& lights, Profiles& profiles) {
    for (const auto& light : lights)
        if (light.profile) profiles.insert(light.profile);
}

template <typename Lights>
void take_away(const Lights& lights, Profiles& profiles) {
    for (const auto& light : lights)
        if (!profiles.empty()) profiles.erase(light.profile);
}

// Whether a light, a preset or a cue may have another profile than before.
bool may_differ(const Scene& before, const Scene& after) {
    const Revision since = before.scene_rev;
    return std::max({after.geometry_rev, after.lights_rev, after.presets_rev, after.cues_rev}) > since ||
           std::ranges::any_of(after.lights, [&](const Light& light) { return light.profile_rev > since; });
}

}  // namespace

void forget_left_profiles(const Scene& before, const Scene& after,
                          const std::vector<std::shared_ptr<const Profile>>& others) {
    Profiles left(others.begin(), others.end());
    left.erase(nullptr);
    if (may_differ(before, after)) {
        add(before.lights, left);
        for (const auto& [name, preset] : before.presets) {
            const auto now = after.presets.find(name);
            if (now == after.presets.end() || now->second != preset) add(*preset, left);
        }
        if (before.cues && before.cues != after.cues)
            for (const auto& cue : *before.cues) add(*cue->content, left);
    }
    if (left.empty()) return;
    take_away(after.lights, left);
    for (const auto& [name, preset] : after.presets) take_away(*preset, left);
    if (after.cues)
        for (const auto& cue : *after.cues) take_away(*cue->content, left);
    for (const auto& profile : left) forget_tables(*profile);
}

}  // namespace gonio
