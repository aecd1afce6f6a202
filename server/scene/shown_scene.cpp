#include "server/scene/shown_scene.h"

#include <algorithm>
#include <cmath>

#include "server/scene/apply.h"
#include "server/scene/apply_light.h"
#include "server/scene/false_color.h"
#include "server/scene/light_values.h"
#include "server/scene/limits.h"
#include "server/scene/orientation.h"
#include "server/scene/scene.h"
#include "server/scene/shaped_profile.h"

namespace gonio {
namespace {

constexpr std::uint32_t kFurtherIds = 0x40000000u;  // beyond those of any scene; below kSummed

void set_weight(Light& light, const glm::dvec3& weight) {
    light.color = weight;
    light.tint_duv = light.cct_k = 0.0;
    light.gel = nullptr;
    light.level_ratio = light.shutter_ratio = light.multiplier = light.tilt_factor = 1.0;
    light.strobe_hz = 0.0;
}

bool same_place(const Light& a, const Light& b) {
    return (a.sun || glm::distance(a.position, b.position) < 1e-9) &&
           std::abs(glm::dot(a.world_from_light, b.world_from_light)) > 1.0 - 1e-12 && a.profile == b.profile &&
           shaping_of(a) == shaping_of(b);
}

// Result: the light as the preset keeps it. now: the light of its name; null: it is gone.
Light light_then(const Scene& scene, const PresetLight& kept, const Light* now) {
    Light then;
    if (now != nullptr) {
        then = *now;
    } else {
        const auto& seeds = scene.asset->lights;
        const auto seed = std::ranges::find(seeds, kept.name, &LightSeed::name);
        if (seed != seeds.end()) {
            then.multiplier = seed->multiplier;
            then.sun = seed->sun;
            then.world_from_mount = seed->world_from_mount;
        }
    }
    const std::shared_ptr<const Profile> own = then.profile;
    static_cast<LightValues&>(then) = kept;
    if (then.world_from_mount != glm::dquat(1.0, 0.0, 0.0, 0.0))  // a saved show keeps the angles alone
        then.world_from_light = then.world_from_mount * orientation_of({then.pan_rad, then.tilt_rad, then.roll_rad});
    if (then.sun && own) then.profile = own;
    follow_values(then);
    return then;
}

void show_difference(Scene& shown, const Preset& preset) {
    const std::size_t lights = shown.lights.size();
    std::vector<Light> further;
    std::vector<glm::dvec3> weights;
    for (const Light& light : shown.lights) weights.push_back(own_weight(light));
    for (std::size_t i = 0; i < preset.size(); ++i) {
        const auto at = std::ranges::find(shown.lights, preset[i].name, &Light::name);
        const bool there = at != shown.lights.end();
        Light then = light_then(shown, preset[i], there ? &*at : nullptr);
        const glm::dvec3 weight = own_weight(then);
        if (there && same_place(*at, then)) {
            weights[static_cast<std::size_t>(at - shown.lights.begin())] -= weight;
            continue;
        }
        if (weight == glm::dvec3(0.0) || lights + further.size() >= kMaxLights) continue;
        set_weight(then, -weight);
        then.id = kFurtherIds + static_cast<std::uint32_t>(i);
        then.name = preset[i].name + " (" + shown.view_compare + ")";
        then.position_rev = then.aim_rev = then.profile_rev = then.level_rev = then.name_rev = shown.compare_rev;
        further.push_back(std::move(then));
    }
    for (std::size_t i = 0; i < lights; ++i) set_weight(shown.lights[i], weights[i]);
    std::ranges::move(further, std::back_inserter(shown.lights));
}

}  // namespace

std::optional<Scene> shown_scene(const Scene& scene, View view) {
    const bool difference = shows_difference(scene, view), one = shows_one_light(scene, view);
    if ((!difference && !one) || scene.emission_hidden) return std::nullopt;  // it was made here
    Scene shown = scene;
    shown.emission_hidden = true;
    if (difference) show_difference(shown, *scene.presets.at(scene.view_compare));
    if (!one) return shown;
    const std::string then = scene.view_only + " (" + scene.view_compare + ")";
    for (Light& light : shown.lights)
        if (light.name != scene.view_only && !(light.id >= kFurtherIds && light.name == then))
            set_weight(light, glm::dvec3(0.0));
    return shown;
}

std::array<Scene, 2> signed_parts(const Scene& shown) {
    std::array<Scene, 2> parts = {shown, shown};
    for (std::size_t i = 0; i < shown.lights.size(); ++i) {
        const glm::dvec3 weight = own_weight(shown.lights[i]);
        set_weight(parts[0].lights[i], glm::max(weight, 0.0));
        set_weight(parts[1].lights[i], glm::max(-weight, 0.0));
    }
    return parts;
}

}  // namespace gonio
