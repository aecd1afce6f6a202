// Which luminaires keep their light in a layer of their own, and which own layers follow in a frame.
#include <algorithm>
#include <set>
#include <utility>

#include "server/render/pipeline.h"
#include "server/render/renderer.h"
#include "server/scene/apply.h"
#include "server/scene/limits.h"
#include "server/scene/scene.h"

namespace gonio {

// Which luminaires have a layer, where not all can: those that have, and those that change, as long as they fit; where
// they do not, half of those that changed longest ago go first, so that not every one that comes makes another one go.
void Renderer::keep_layers(const Scene& scene) {
    const Revision last = std::exchange(layered_rev_, scene.scene_rev);
    if (scene.lights.size() <= layer_count_) {
        layered_.clear();
        in_sum_.clear();
        return;
    }
    if (last == scene.scene_rev && layered_.size() == layer_count_) return;
    const auto take_from = [&](std::uint32_t id) {
        std::replace(layered_.begin(), layered_.end(), id, std::uint32_t{0});
        if (const auto gpu = lights_.find(id); gpu != lights_.end()) {
            LightGpu bare;
            bare.web = gpu->second.web;
            bare.profile = gpu->second.profile;
            gpu->second = std::move(bare);
        }
        pass_cache_.forget_light(id);
        in_sum_.clear();  // the sum is made anew with it
    };
    while (layered_.size() > layer_count_) {  // the picture is larger than it was
        if (layered_.back() != 0) take_from(layered_.back());
        layered_.pop_back();
    }
    layered_.resize(layer_count_, 0);
    std::vector<std::pair<Revision, std::uint32_t>> kept;
    std::vector<const Light*> coming;
    for (const Light& light : scene.lights) {
        const Revision placed = std::max({light.position_rev, light.aim_rev, light.profile_rev}),
                       changed = light.strobe_hz > 0.0 ? scene.scene_rev : std::max(placed, light.level_rev);
        if (std::find(layered_.begin(), layered_.end(), light.id) != layered_.end())
            kept.emplace_back(changed, light.id);
        else if (changed > last && last > 0)
            coming.push_back(&light);
        else if (!lights_.at(light.id).irradiance.indirect.empty())
            take_from(light.id);  // when all had one
        if (placed > last) in_sum_.erase(light.id);
    }
    for (const std::uint32_t id : std::vector(layered_)) {
        const bool here = std::any_of(kept.begin(), kept.end(), [&](const auto& one) { return one.second == id; });
        if (id != 0 && !here) take_from(id);
    }
    if (scene.lights_rev > last) in_sum_.clear();
    if (coming.size() > layer_count_) {  // the sum follows them
        in_sum_.clear();
        return;
    }
    const std::size_t all = kept.size() + coming.size();
    if (all > layer_count_) {
        std::sort(kept.begin(), kept.end());
        const std::size_t going = std::max(all - layer_count_, kept.size() / 2);
        for (std::size_t i = 0; i < going; ++i) take_from(kept[i].second);
    }
    for (const Light* light : coming) {
        *std::find(layered_.begin(), layered_.end(), 0u) = light->id;
        // Until the picture rests the sum goes on with what it was summed at, and its layer shows the difference.
        const auto was = weights_.find(light->id);
        const bool unmoved = std::max({light->position_rev, light->aim_rev, light->profile_rev}) <= last;
        if (unmoved && was != weights_.end() && scene.lights_rev <= last) in_sum_[light->id] = was->second;
    }
}

// By light: its layer of a target, -1: it is summed.
std::vector<int> Renderer::layers_of(const Scene& scene, const Target& target) const {
    std::vector<int> layers(scene.lights.size());
    const std::size_t fit = target.id == live_.id ? layer_count_ : kMostLayers;
    for (std::size_t i = 0; i < layers.size(); ++i) {
        const auto own = std::find(layered_.begin(), layered_.end(), scene.lights[i].id);
        layers[i] = layers.size() <= fit    ? static_cast<int>(i)
                    : own != layered_.end() ? static_cast<int>(own - layered_.begin())
                                            : -1;
    }
    return layers;
}

// Whether the picture is made of all luminaires at once, and which own layers follow in this frame. While the camera
// moves, or more luminaires than would be quicker one by one, it is; when they rest one luminaire after the other is
// made on its own, those at level 0 last, and with the last of them the picture is theirs.
void Renderer::choose_layers(FrameInputs& inputs) {
    const Scene& scene = inputs.scene;
    const Revision last = inputs.seen_rev = std::exchange(last_rev_, scene.scene_rev);
    const bool merged_before = std::exchange(merged_, false);
    if (!inputs.can_merge()) return;
    const std::vector<Pass> passes = build_pipeline(inputs);
    const std::set<SlotRef> old = outdated(passes, wanted_slots(inputs, true), pass_cache_);
    // Shaders have each luminaire's own light by the way, once it is solved.
    const bool by_gl = inputs.gathers_by_gl(), grid_moves = !by_gl && old.contains({Slot::grid, live_.id, 0});
    std::vector<std::pair<bool, std::uint32_t>> waiting;  // dark, id
    std::size_t stale = 0;
    for (const Light& light : scene.lights) {
        const bool is_old = by_gl ? old.contains({Slot::solve, 0, light.id})
                                  : old.contains({Slot::direct, live_.id, light.id}) ||
                                        old.contains({Slot::gather, live_.id, light.id});
        if (!is_old) continue;
        ++stale;
        const bool rests = std::max({light.position_rev, light.aim_rev, light.profile_rev}) <= last;
        if (rests) waiting.emplace_back(light_weight(scene, light) == glm::dvec3(0.0), light.id);
    }
    const bool many = stale > (by_gl ? 4 : 2) + inputs.layered() / 4;
    merged_ = grid_moves ? stale > 0 : stale > 1 && (merged_before || many);
    inputs.merged = merged_;
    if (merged_) in_sum_.clear();  // the sum is made anew, or what moves was never in it
    if (!merged_ || grid_moves || waiting.empty()) return;
    // What is shown comes first: the solve of all at once to its end.
    const std::set<SlotRef> left = outdated(build_pipeline(inputs), wanted_slots(inputs, true), pass_cache_);
    if (left.contains({Slot::merged_solve, live_.id, 0}) && !left.contains({Slot::merged, live_.id, 0})) return;
    // In turn, so that none that goes on moving holds up the others.
    std::sort(waiting.begin(), waiting.end());
    const bool dark = waiting.front().first;
    const auto end = std::find_if(waiting.begin(), waiting.end(), [&](const auto& one) { return one.first != dark; });
    const auto next = std::upper_bound(waiting.begin(), end, std::pair(dark, refilled_));
    refilled_ = next != end ? next->second : waiting.front().second;
    inputs.refill.push_back(refilled_);
}

}  // namespace gonio
