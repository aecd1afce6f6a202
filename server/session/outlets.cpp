#include "server/session/outlets.h"

#include <algorithm>

#include "ies/core/printed.h"
#include "server/scene/light_values.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

// Result: the light as it was, nullptr where it is new.
const Light* same_light(const Scene& before, const Light& light) {
    const auto at = std::ranges::find(before.lights, light.id, &Light::id);
    return at == before.lights.end() ? nullptr : &*at;
}

std::string sentence_of(const Scene& scene, const Light& light, const trace::Obstacle& obstacle) {
    const std::string& node = scene.asset->instances[static_cast<std::size_t>(obstacle.instance)].node;
    return "the light '" + light.name +
           "' shines into nothing: " + (node.empty() ? "a surface " : "the surface '" + node + "' ") +
           printed("%.3g m before it stops its light; recess light may put it there", obstacle.distance_m);
}

Revision asked_rev_of(const Light& light) {
    return std::max({light.position_rev, light.aim_rev, light.profile_rev});
}

// Sentences of one kind, the first ones in full and the rest counted.
class Sentences {
public:
    void add(const Scene& scene, const Light& light, const trace::Obstacle& obstacle) {
        if (said_.size() < kMostOutletWarnings)
            said_.push_back(sentence_of(scene, light, obstacle));
        else
            ++more_;
    }
    std::vector<std::string> take() {
        if (more_ > 0) said_.push_back(std::to_string(more_) + " more lights shine into nothing");
        return std::move(said_);
    }

private:
    std::vector<std::string> said_;
    std::size_t more_ = 0;
};

}  // namespace

std::vector<std::string> outlet_warnings(const Scene& scene, const Scene* before, HiddenLights* hidden) {
    if (!scene.traced) return {};
    const bool all = before == nullptr || before->asset != scene.asset;
    if (hidden != nullptr && all) *hidden = {{}, scene.asset};
    Sentences sentences;
    std::size_t asked = 0;
    for (const Light& light : scene.lights) {
        if (!all && asked_rev_of(light) <= before->scene_rev) continue;
        if (light.missing || (!all && ++asked > kMostOutletsAsked)) continue;
        const auto obstacle = trace::obstacle_of(*scene.traced, light);
        if (hidden != nullptr && !obstacle) hidden->by_id.erase(light.id);
        if (!obstacle) continue;
        if (hidden != nullptr) hidden->by_id[light.id] = {*obstacle, scene.scene_rev};
        const Light* const was = all ? nullptr : same_light(*before, light);
        if (was != nullptr && trace::obstacle_of(*scene.traced, *was)) continue;
        sentences.add(scene, light, *obstacle);
    }
    return sentences.take();
}

std::vector<std::string> HiddenLights::warnings(const Scene& scene) {
    if (!scene.traced) return {};
    if (asset != scene.asset) outlet_warnings(scene, nullptr, this);
    if (by_id.empty()) return {};  // the usual case: frames and consoles cast no rays
    Sentences sentences;
    std::size_t asked = 0;
    std::map<std::uint32_t, Hidden> still;
    for (const Light& light : scene.lights) {
        const auto known = by_id.find(light.id);
        if (known == by_id.end() || light.missing) continue;
        if (asked_rev_of(light) > known->second.asked_rev) {
            if (++asked > kMostOutletsAsked) {  // nobody knows: nothing is said
                still.insert(*known);
                continue;
            }
            const auto obstacle = trace::obstacle_of(*scene.traced, light);
            if (!obstacle) continue;
            known->second = {*obstacle, scene.scene_rev};
        }
        sentences.add(scene, light, known->second.obstacle);
        still.insert(*known);
    }
    by_id = std::move(still);
    return sentences.take();
}

}  // namespace gonio
