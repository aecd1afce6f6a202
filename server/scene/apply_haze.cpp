#include "server/scene/apply_haze.h"

#include "protocol/schema/scene.pb.h"
#include "server/scene/apply_checks.h"
#include "server/scene/limits.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

struct HazePreset {
    const char* name;
    double extinction_per_m;
};
// Droplets of 1 to 2 µm at 0.7, 2 and 25 mg/m³; their albedo is 1 and their g 0.7 (docs/rendering.md#haze).
constexpr HazePreset kPresets[] = {{"off", 0.0}, {"faint", 0.003}, {"show", 0.01}, {"fog", 0.1}};

HazeValues preset_named(const std::string& name) {
    std::string names;
    for (const HazePreset& preset : kPresets) {
        if (name == preset.name) return {.extinction_per_m = preset.extinction_per_m};
        names += (names.empty() ? "" : ", ") + std::string(preset.name);
    }
    refuse("invalid_argument", "set_haze.preset", shortened_text(name, kMaxNameBytes), "must be one of " + names);
}

}  // namespace

void set_haze(Scene& scene, const v1::SetHaze& set) {
    HazeValues haze = set.has_preset() ? preset_named(set.preset()) : scene.haze;
    if (set.has_extinction_per_m())
        haze.extinction_per_m =
            checked(set.extinction_per_m(), 0.0, kMostExtinction_per_m, "set_haze.extinction_per_m");
    if (set.has_albedo()) haze.albedo = checked(set.albedo(), 0.0, 1.0, "set_haze.albedo");
    if (set.has_g()) haze.g = checked(set.g(), -kMostHazeG, kMostHazeG, "set_haze.g");
    if (set.has_layer_height_m() && set.layer_height_m() != 0.0)
        checked(set.layer_height_m(), kLeastLayer_m, kMostLayer_m, "set_haze.layer_height_m");
    if (set.has_layer_height_m()) haze.layer_height_m = set.layer_height_m();
    change(scene, scene.haze, haze, scene.haze_rev);
}

void put_haze(const HazeValues& haze, v1::Haze& out) {
    out.set_extinction_per_m(haze.extinction_per_m);
    out.set_albedo(haze.albedo);
    out.set_g(haze.g);
    out.set_layer_height_m(haze.layer_height_m);
}

}  // namespace gonio
