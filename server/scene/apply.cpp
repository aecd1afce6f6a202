#include "server/scene/apply.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <sstream>

#include "protocol/dmx/patch.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/surface/surface_map.h"
#include "protocol/text/shortened_text.h"
#include "server/scene/console.h"
#include "server/scene/light_tables.h"
#include "server/scene/orientation.h"
#include "server/scene/preset.h"

namespace gonio {
namespace {

// All refusals leave through this exception, inside this file only: a refused command has touched nothing but a copy.
struct Refused {
    Error error;
};

[[noreturn]] void refuse(std::string code, std::string where, std::string value, std::string message) {
    throw Refused{{std::move(code), std::move(where), std::move(value), std::move(message)}};
}

double checked(double value, double low, double high, const std::string& field) {
    if (!(value >= low && value <= high)) {
        refuse("invalid_argument", field, print_number(value),
               "must be a number from " + print_number(low) + " to " + print_number(high));
    }
    return value;
}

template <typename Field>
std::string print_all(const Field& field) {
    std::string text;
    for (double value : field) text += (text.empty() ? "" : ",") + print_number(value);
    return text;
}

constexpr double kMaxCoordinateM = 1e6;  // farther positions are refused

template <typename Field>
glm::dvec3 checked_vector(const Field& field, double low, double high, const std::string& name) {
    if (field.size() != 3) refuse("invalid_argument", name, print_all(field), "must be three numbers");
    glm::dvec3 result;
    for (int i = 0; i < 3; ++i) {
        if (!(field[i] >= low && field[i] <= high)) {
            refuse("invalid_argument", name, print_all(field),
                   "must be three numbers from " + print_number(low) + " to " + print_number(high));
        }
        result[i] = field[i];
    }
    return result;
}

template <typename Field>
glm::dvec3 checked_direction(const Field& field, const std::string& name) {
    const glm::dvec3 d = checked_vector(field, -1e9, 1e9, name);
    if (glm::length(d) < 1e-9) refuse("invalid_argument", name, print_all(field), "must not be the zero vector");
    return glm::normalize(d);
}

std::string checked_name(const std::string& name, const std::string& field) {
    if (name.empty() || name.size() > kMaxNameBytes) {
        refuse("invalid_argument", field, shortened_text(name, kMaxNameBytes), "must have 1 to 128 bytes");
    }
    const std::string shown = shortened_text(name, kMaxNameBytes);
    if (shown != name)
        refuse("invalid_argument", field, shown,
               "must be UTF-8 without control characters, also none of the direction of writing");
    return name;
}

// Assigns and bumps the part's revision only where the value differs.
template <typename T>
void change(Scene& scene, T& slot, const T& value, Revision& part_rev) {
    if (slot == value) return;
    slot = value;
    part_rev = scene.scene_rev + 1;
}

Light* find_light(Scene& scene, const std::string& name) {
    const auto at =
        std::find_if(scene.lights.begin(), scene.lights.end(), [&](const Light& l) { return l.name == name; });
    return at == scene.lights.end() ? nullptr : &*at;
}

// Result: the same profile as a light has it already, so that they share what is made of it; or the one given.
std::shared_ptr<const Profile> shared_profile(const Scene& scene, const std::shared_ptr<const Profile>& profile) {
    for (const Light& light : scene.lights) {
        if (light.profile == profile || *light.profile == *profile) return light.profile;
    }
    return profile;
}

// Pan, tilt and roll of an orientation that was given otherwise.
void take_angles(Light& light) {
    const PanTiltRoll angles = angles_of(light.world_from_light);
    light.pan_rad = angles.pan_rad;
    light.tilt_rad = angles.tilt_rad;
    light.roll_rad = angles.roll_rad;
}

void set_one_light(Scene& scene, Light& light, const v1::SetLight& set, const Loaded& loaded,
                   const std::string& prefix) {
    if (set.position_m_size() > 0) {
        change(scene, light.position,
               checked_vector(set.position_m(), -kMaxCoordinateM, kMaxCoordinateM, prefix + "position_m"),
               light.position_rev);
    }
    const bool turns = set.has_pan_rad() || set.has_tilt_rad() || set.has_roll_rad();
    if (set.aim_size() > 0) {
        if (turns)
            refuse("conflict", prefix + "aim", print_all(set.aim()),
                   "aim cannot be set together with pan, tilt or roll");
        const glm::dquat orientation = orientation_aiming(checked_direction(set.aim(), prefix + "aim"));
        change(scene, light.world_from_light, orientation, light.aim_rev);
        take_angles(light);
    } else if (turns) {
        constexpr double kLimit = 64 * std::numbers::pi;
        if (set.has_pan_rad())
            change(scene, light.pan_rad, checked(set.pan_rad(), -kLimit, kLimit, prefix + "pan_rad"), light.aim_rev);
        if (set.has_tilt_rad())
            change(scene, light.tilt_rad, checked(set.tilt_rad(), -kLimit, kLimit, prefix + "tilt_rad"), light.aim_rev);
        if (set.has_roll_rad())
            change(scene, light.roll_rad, checked(set.roll_rad(), -kLimit, kLimit, prefix + "roll_rad"), light.aim_rev);
        light.world_from_light = orientation_of({light.pan_rad, light.tilt_rad, light.roll_rad});
    }
    if (set.has_level_ratio())
        change(scene, light.level_ratio, checked(set.level_ratio(), 0.0, 1.0, prefix + "level_ratio"), light.level_rev);
    if (set.color_rgb_size() > 0) {
        change(scene, light.color, checked_vector(set.color_rgb(), 0.0, 1e4, prefix + "color_rgb"), light.level_rev);
    }
    if (loaded.profile) change(scene, light.profile, shared_profile(scene, loaded.profile), light.profile_rev);
}

void set_light(Scene& scene, const v1::SetLight& set, const Loaded& loaded) {
    if (Light* light = find_light(scene, set.name())) return set_one_light(scene, *light, set, loaded, "set_light.");
    const auto group = scene.groups.find(set.name());
    if (group == scene.groups.end())
        refuse("not_found", "set_light.name", set.name(), "there is no light or group of this name");
    for (const std::string& name : group->second)
        set_one_light(scene, *find_light(scene, name), set, loaded, "set_light.");
}

void add_light(Scene& scene, const v1::SetLight& set, const Loaded& loaded) {
    const std::string name = checked_name(set.name(), "add_light.light.name");
    if (find_light(scene, name) != nullptr || scene.groups.contains(name)) {
        refuse("already_exists", "add_light.light.name", name, "a light or group of this name exists");
    }
    if (scene.lights.size() >= kMaxLights) {
        refuse("too_many_lights", "add_light.light.name", name,
               "a scene holds at most " + std::to_string(kMaxLights) + " lights");
    }
    if (!loaded.profile) refuse("invalid_argument", "add_light.light.profile", "", "a new light needs a profile");
    Light light;
    light.id = scene.next_light_id++;
    light.name = name;
    light.profile = shared_profile(scene, loaded.profile);
    light.world_from_light = orientation_of({});
    light.position = (scene.asset->bounds.min + scene.asset->bounds.max) * 0.5;
    light.position_rev = light.aim_rev = light.profile_rev = light.level_rev = scene.scene_rev + 1;
    set_one_light(scene, light, set, loaded, "add_light.light.");
    scene.lights.push_back(std::move(light));
    scene.lights_rev = scene.scene_rev + 1;
}

void remove_light(Scene& scene, const std::string& name) {
    Light* light = find_light(scene, name);
    if (light == nullptr) refuse("not_found", "remove_light.name", name, "there is no light of this name");
    scene.lights.erase(scene.lights.begin() + (light - scene.lights.data()));
    scene.lights_rev = scene.scene_rev + 1;
    for (auto group = scene.groups.begin(); group != scene.groups.end();) {
        if (std::erase(group->second, name) > 0) scene.groups_rev = scene.scene_rev + 1;
        group = group->second.empty() ? scene.groups.erase(group) : std::next(group);
    }
    if (scene.view_light == name) {
        scene.view_light.clear();
        scene.view_rev = scene.scene_rev + 1;
    }
}

void set_group(Scene& scene, const v1::SetGroup& set) {
    const std::string name = checked_name(set.name(), "set_group.name");
    if (find_light(scene, name) != nullptr) refuse("already_exists", "set_group.name", name, "a light has this name");
    std::vector<std::string> lights;
    for (const std::string& light : set.lights()) {
        if (find_light(scene, light) == nullptr)
            refuse("not_found", "set_group.lights", light, "there is no light of this name");
        if (std::find(lights.begin(), lights.end(), light) == lights.end()) lights.push_back(light);
    }
    if (lights.empty()) {
        if (scene.groups.erase(name) == 0)
            refuse("not_found", "set_group.name", name, "there is no group of this name");
        scene.groups_rev = scene.scene_rev + 1;
        return;
    }
    if (!scene.groups.contains(name) && scene.groups.size() >= kMaxGroups) {
        refuse("too_many_groups", "set_group.name", name,
               "a scene holds at most " + std::to_string(kMaxGroups) + " groups");
    }
    change(scene, scene.groups[name], lights, scene.groups_rev);
}

void set_view(Scene& scene, const v1::SetView& set) {
    if (!set.view().empty()) {
        View view;
        if (!parse_view(set.view(), view)) {
            refuse("invalid_argument", "set_view.view", set.view(),
                   "must be one of beauty, direct, indirect, illuminance, luminance, mask, rsm-depth, rsm-normal, "
                   "rsm-flux, solid");
        }
        change(scene, scene.view, view, scene.view_rev);
    }
    if (set.has_gain())
        change(scene, scene.view_gain, checked(set.gain(), 0.01, 1000.0, "set_view.gain"), scene.view_rev);
    if (set.has_light()) {
        if (!set.light().empty() && find_light(scene, set.light()) == nullptr) {
            refuse("not_found", "set_view.light", set.light(), "there is no light of this name");
        }
        change(scene, scene.view_light, set.light(), scene.view_rev);
    }
}

void set_technique(Scene& scene, const v1::SetTechnique& set) {
    Technique technique = scene.technique;
    if (set.technique() == "default")
        technique = Technique::standard;
    else if (set.technique() == "seed")
        technique = Technique::seed;
    else if (set.technique() == "seed-disk")
        technique = Technique::seed_disk;
    else if (!set.technique().empty()) {
        refuse("invalid_argument", "set_technique.technique", set.technique(), "must be default, seed or seed-disk");
    }
    const bool standard = technique == Technique::standard;
    std::uint32_t samples = scene.samples;
    if (technique != scene.technique) samples = standard ? kDefaultVpls : kDefaultSeedSamples;
    if (set.has_samples()) {
        samples =
            static_cast<std::uint32_t>(checked(set.samples(), standard ? 16.0 : 1.0, 4096.0, "set_technique.samples"));
    }
    change(scene, scene.technique, technique, scene.technique_rev);
    change(scene, scene.samples, samples, scene.technique_rev);
}

void set_camera(Scene& scene, const v1::SetCamera& set) {
    Camera camera = scene.camera;
    if (set.eye_m_size() > 0)
        camera.eye = checked_vector(set.eye_m(), -kMaxCoordinateM, kMaxCoordinateM, "set_camera.eye_m");
    if (set.target_m_size() > 0)
        camera.target = checked_vector(set.target_m(), -kMaxCoordinateM, kMaxCoordinateM, "set_camera.target_m");
    if (set.has_fov_rad()) camera.fov_rad = checked(set.fov_rad(), 0.02, 3.0, "set_camera.fov_rad");
    if (glm::distance(camera.eye, camera.target) < 1e-6) {
        refuse("invalid_argument", "set_camera.target_m", print_all(set.target_m()),
               "eye and target must not coincide");
    }
    change(scene, scene.camera.eye, camera.eye, scene.camera_rev);
    change(scene, scene.camera.target, camera.target, scene.camera_rev);
    change(scene, scene.camera.fov_rad, camera.fov_rad, scene.camera_rev);
}

void set_size(Scene& scene, const v1::SetSize& set) {
    const int width = static_cast<int>(checked(set.width_px(), 16, 4096, "set_size.width_px"));
    const int height = static_cast<int>(checked(set.height_px(), 16, 4096, "set_size.height_px"));
    if (width % 2 != 0) refuse("invalid_argument", "set_size.width_px", std::to_string(width), "must be even");
    if (height % 2 != 0) refuse("invalid_argument", "set_size.height_px", std::to_string(height), "must be even");
    change(scene, scene.width_px, width, scene.size_rev);
    change(scene, scene.height_px, height, scene.size_rev);
}

void set_patch(Scene& scene, const v1::SetPatch& set) {
    if (const auto checked = check_patch(set); !checked) throw Refused{checked.error()};
    scene.patch = set.use_default() ? nullptr : std::make_shared<const v1::SetPatch>(set);
    scene.patch_rev = scene.scene_rev + 1;
}

void set_surfaces(Scene& scene, const v1::SetSurfaces& set) {
    if (const auto checked = check_surfaces(set); !checked) throw Refused{checked.error()};
    scene.surfaces = std::make_shared<const v1::SetSurfaces>(set);
    scene.surfaces_rev = scene.scene_rev + 1;
}

void map_control(Scene& scene, const v1::MapControl& set) {
    v1::SetSurfaces rows;
    if (scene.surfaces)
        rows = *scene.surfaces;
    else
        rows.set_with_default(true);
    auto merged = mapped(rows, set);
    if (!merged) throw Refused{merged.error()};
    scene.surfaces = std::make_shared<const v1::SetSurfaces>(std::move(*merged));
    scene.surfaces_rev = scene.scene_rev + 1;
}

void save_preset(Scene& scene, const std::string& given, const Loaded& loaded) {
    const std::string name = checked_name(given, "save_preset.name");
    if (!scene.presets.contains(name) && scene.presets.size() >= kMaxPresets)
        refuse("too_many_presets", "save_preset.name", name,
               "a scene keeps at most " + std::to_string(kMaxPresets) + " presets");
    scene.presets_rev = scene.scene_rev + 1;
    if (loaded.preset) {  // read from a file: the lights do not show it
        scene.presets[name] = loaded.preset;
        return;
    }
    scene.presets[name] = std::make_shared<const Preset>(preset_of(scene));
    scene.recalled = name;
}

void remove_preset(Scene& scene, const std::string& name) {
    if (scene.presets.erase(name) == 0)
        refuse("not_found", "remove_preset.name", name, "there is no preset of this name");
    if (scene.recalled == name) scene.recalled.clear();
    scene.presets_rev = scene.scene_rev + 1;
}

void recall_preset(Scene& scene, const v1::RecallPreset& recall) {
    const auto preset = scene.presets.find(recall.name());
    if (preset == scene.presets.end())
        refuse("not_found", "recall_preset.name", recall.name(), "there is no preset of this name");
    const bool fades = checked(recall.fade_s(), 0.0, kMaxFade_s, "recall_preset.fade_s") > 0;
    for (const PresetLight& kept : *preset->second) {
        Light* light = find_light(scene, kept.name);
        if (light == nullptr) continue;
        change(scene, light->profile, kept.profile, light->profile_rev);
        if (fades) continue;  // server/scene/preset.h brings the rest in time
        change(scene, light->position, kept.position, light->position_rev);
        change(scene, light->world_from_light, kept.world_from_light, light->aim_rev);
        change(scene, light->pan_rad, kept.pan_rad, light->aim_rev);
        change(scene, light->tilt_rad, kept.tilt_rad, light->aim_rev);
        change(scene, light->roll_rad, kept.roll_rad, light->aim_rev);
        change(scene, light->level_ratio, kept.level_ratio, light->level_rev);
        change(scene, light->color, kept.color, light->level_rev);
    }
    change(scene, scene.recalled, recall.name(), scene.presets_rev);
}

void load_scene(Scene& scene, const Loaded& loaded) {
    if (!loaded.asset) refuse("invalid_argument", "load_scene.file", "", "no scene was loaded");
    Scene fresh = scene_of(loaded.asset, scene.scene_rev + 1);
    fresh.traced = loaded.traced;
    fresh.drawn = loaded.drawn;
    fresh.scene_rev = scene.scene_rev;
    fresh.next_light_id += scene.next_light_id;
    for (Light& light : fresh.lights) light.id += scene.next_light_id;
    // What belongs to the viewer rather than to the scene stays.
    fresh.patch = scene.patch;
    fresh.surfaces = scene.surfaces;
    fresh.presets = scene.presets;  // of lights by name: files are written anew, and scenes come back
    fresh.presets_rev = scene.presets_rev;
    fresh.view = scene.view;
    fresh.view_gain = scene.view_gain;
    fresh.master_ratio = scene.master_ratio;
    fresh.technique = scene.technique;
    fresh.samples = scene.samples;
    fresh.width_px = scene.width_px;
    fresh.height_px = scene.height_px;
    scene = std::move(fresh);
}

void dispatch(Scene& scene, const v1::Command& command, const Loaded& loaded) {
    switch (command.command_case()) {
        case v1::Command::kLoadScene:
            return load_scene(scene, loaded);
        case v1::Command::kSetTechnique:
            return set_technique(scene, command.set_technique());
        case v1::Command::kSetView:
            return set_view(scene, command.set_view());
        case v1::Command::kSetExposure:
            if (command.set_exposure().has_ev100()) {
                change(scene, scene.exposure_ev100,
                       checked(command.set_exposure().ev100(), -10.0, 24.0, "set_exposure.ev100"), scene.exposure_rev);
            }
            return;
        case v1::Command::kSetMaster:
            if (command.set_master().has_ratio()) {
                change(scene, scene.master_ratio, checked(command.set_master().ratio(), 0.0, 1.0, "set_master.ratio"),
                       scene.master_rev);
            }
            return;
        case v1::Command::kSetLight:
            return set_light(scene, command.set_light(), loaded);
        case v1::Command::kSetCamera:
            return set_camera(scene, command.set_camera());
        case v1::Command::kAddLight:
            return add_light(scene, command.add_light().light(), loaded);
        case v1::Command::kRemoveLight:
            return remove_light(scene, command.remove_light().name());
        case v1::Command::kSetPatch:
            return set_patch(scene, command.set_patch());
        case v1::Command::kSavePreset:
            return save_preset(scene, command.save_preset().name(), loaded);
        case v1::Command::kRecallPreset:
            return recall_preset(scene, command.recall_preset());
        case v1::Command::kRemovePreset:
            return remove_preset(scene, command.remove_preset().name());
        case v1::Command::kSetSurfaces:
            return set_surfaces(scene, command.set_surfaces());
        case v1::Command::kMapControl:
            return map_control(scene, command.map_control());
        case v1::Command::kSetGroup:
            return set_group(scene, command.set_group());
        case v1::Command::kSetSize:
            return set_size(scene, command.set_size());
        case v1::Command::COMMAND_NOT_SET:
            break;
    }
    refuse("unsupported", "command", "", "this server does not know the command");
}

// The lamp's output at this tilt, the angle between the aim and nadir; 1 without a TILT table.
double tilt_factor_of(const Light& light) {
    const auto& table = light.profile->photometry.tilt;
    if (!table) return 1.0;
    const double down = std::clamp(-aim_of(light.world_from_light).y, -1.0, 1.0);
    return ies::tilt_factor(*table, Angle::radians(std::acos(down)));
}

void check_layers(const Scene& scene) {
    if (scene.technique == Technique::standard) return;
    if (scene.lights.size() > kMostLayers)
        refuse("too_many_lights", "technique", std::to_string(scene.lights.size()),
               "the seed technique renders at most " + std::to_string(kMostLayers) + " lights");
    const std::size_t pixels = static_cast<std::size_t>(scene.width_px) * static_cast<std::size_t>(scene.height_px);
    if (pixels * scene.lights.size() * kLayerBytesPerPixel <= kMaxLayerBytes) return;
    refuse("too_large", "size_px", std::to_string(scene.width_px) + "x" + std::to_string(scene.height_px),
           "the irradiance of " + std::to_string(scene.lights.size()) + " lights at this size exceeds " +
               std::to_string(kMaxLayerBytes >> 30) + " GiB");
}

Revision newest_part(const Scene& scene) {
    Revision newest = std::max({scene.geometry_rev, scene.camera_rev, scene.view_rev, scene.exposure_rev,
                                scene.master_rev, scene.technique_rev, scene.size_rev, scene.lights_rev,
                                scene.groups_rev, scene.patch_rev, scene.surfaces_rev, scene.presets_rev});
    for (const Light& light : scene.lights) {
        newest = std::max({newest, light.position_rev, light.aim_rev, light.profile_rev, light.level_rev});
    }
    return newest;
}

constexpr const char* kViewNames[] = {"beauty", "direct",    "indirect",   "illuminance", "luminance",
                                      "mask",   "rsm-depth", "rsm-normal", "rsm-flux",    "solid"};

}  // namespace

Result<Applied> apply(Scene& scene, const v1::Command& command, const Loaded& loaded) {
    Scene changed = scene;
    try {
        dispatch(changed, command, loaded);
        check_layers(changed);
        for (Light& light : changed.lights) light.tilt_factor = tilt_factor_of(light);
    } catch (const Refused& refused) {
        return refused.error;
    }
    changed.scene_rev = std::max(scene.scene_rev, newest_part(changed));
    scene = std::move(changed);
    Applied applied{scene.scene_rev, {}};
    if (loaded.profile) {
        for (const ies::Diagnostic& d : loaded.profile->photometry.diagnostics) {
            applied.warnings.push_back(d.code + " (line " + std::to_string(d.line) + "): " + d.message);
        }
        const std::string thinned = known_thinned(*loaded.profile);
        if (!thinned.empty()) applied.warnings.push_back(thinned);
    }
    if (loaded.asset) applied.warnings = loaded.asset->warnings;
    if (command.has_set_surfaces() || command.has_map_control()) applied.warnings = surface_warnings(scene);
    if (command.has_set_patch()) {
        const v1::Patch patch = patch_in_force(scene);
        applied.warnings.assign(patch.warnings().begin(), patch.warnings().end());
    }
    return applied;
}

// Result: why not; then the light is as before.
static std::optional<Error> try_light(Scene& scene, Light& light, const v1::SetLight& set) {
    const Light before = light;
    try {
        set_one_light(scene, light, set, {}, "set_light.");
    } catch (const Refused& refused) {
        light = before;
        return refused.error;
    }
    light.tilt_factor = tilt_factor_of(light);
    return std::nullopt;
}

// Result: the command's properties of a light, one each.
static std::vector<v1::SetLight> single_properties(const v1::SetLight& set) {
    std::vector<v1::SetLight> single;
    if (set.has_level_ratio()) single.emplace_back().set_level_ratio(set.level_ratio());
    if (set.color_rgb_size() > 0) *single.emplace_back().mutable_color_rgb() = set.color_rgb();
    if (set.position_m_size() > 0) *single.emplace_back().mutable_position_m() = set.position_m();
    if (set.aim_size() > 0) *single.emplace_back().mutable_aim() = set.aim();
    if (set.has_pan_rad()) single.emplace_back().set_pan_rad(set.pan_rad());
    if (set.has_tilt_rad()) single.emplace_back().set_tilt_rad(set.tilt_rad());
    if (set.has_roll_rad()) single.emplace_back().set_roll_rad(set.roll_rad());
    return single;
}

static std::optional<Error> apply_input(Scene& scene, const v1::Command& command) {
    if (!command.has_set_light()) {
        if (!command.has_set_master() && !command.has_set_exposure() && !command.has_set_camera() &&
            !command.has_save_preset() && !command.has_recall_preset())
            return Error{"unsupported", "command", "", "a console cannot say this"};
        try {
            dispatch(scene, command, {});  // each checks what it says before it changes anything
            for (Light& light : scene.lights) light.tilt_factor = tilt_factor_of(light);  // a preset turns them
        } catch (const Refused& refused) {
            return refused.error;
        }
        return std::nullopt;
    }
    const v1::SetLight& set = command.set_light();
    Light* light = find_light(scene, set.name());
    if (light == nullptr) return Error{"not_found", "set_light.name", set.name(), "there is no light of this name"};
    std::optional<Error> refused = try_light(scene, *light, set);
    if (!refused) return refused;
    const std::vector<v1::SetLight> single = single_properties(set);
    for (const v1::SetLight& one : single)
        if (single.size() > 1) try_light(scene, *light, one);
    return refused;
}

std::vector<std::optional<Error>> apply_inputs(Scene& scene, std::span<const v1::Command> commands) {
    std::vector<std::optional<Error>> refused;
    for (const v1::Command& command : commands) refused.push_back(apply_input(scene, command));
    scene.scene_rev = std::max(scene.scene_rev, newest_part(scene));
    return refused;
}

static Camera framing(const Bounds& bounds) {
    const glm::dvec3 centre = (bounds.min + bounds.max) * 0.5;
    const double radius = std::max(glm::length(bounds.max - bounds.min) * 0.5, 1e-3);
    Camera camera;
    camera.target = centre;
    camera.eye = centre + glm::normalize(glm::dvec3(0.6, 0.45, 1.0)) * radius * 2.6;
    return camera;
}

Scene scene_of(std::shared_ptr<const SceneAsset> asset, Revision revision) {
    Scene scene;
    scene.scene_rev = scene.geometry_rev = scene.camera_rev = scene.view_rev = scene.exposure_rev = scene.master_rev =
        scene.technique_rev = scene.size_rev = scene.lights_rev = scene.groups_rev = scene.patch_rev =
            scene.surfaces_rev = scene.presets_rev = revision;
    scene.camera = asset->cameras.empty() ? framing(asset->bounds) : asset->cameras.front();
    scene.exposure_ev100 = asset->exposure_ev100;
    for (const LightSeed& seed : asset->lights) {
        if (scene.lights.size() == kMaxLights) break;  // the loader has warned
        Light light;
        light.id = scene.next_light_id++;
        light.name = seed.name;
        light.position = seed.position;
        light.world_from_light = glm::normalize(seed.world_from_light);
        take_angles(light);
        light.profile = seed.profile;
        light.multiplier = seed.multiplier;
        light.color = seed.color;
        light.tilt_factor = tilt_factor_of(light);
        light.position_rev = light.aim_rev = light.profile_rev = light.level_rev = revision;
        scene.lights.push_back(std::move(light));
    }
    scene.asset = std::move(asset);
    return scene;
}

glm::dvec3 light_weight(const Scene& scene, const Light& light) {
    return own_weight(light) * scene.master_ratio;
}

glm::dvec3 own_weight(const Light& light) {
    return light.color * (light.level_ratio * light.multiplier * light.tilt_factor);
}

const char* view_name(View view) {
    return kViewNames[static_cast<int>(view)];
}

bool parse_view(const std::string& name, View& view) {
    for (int i = 0; i < 10; ++i) {
        if (name == kViewNames[i]) {
            view = static_cast<View>(i);
            return true;
        }
    }
    return false;
}

const char* technique_name(Technique technique) {
    return technique == Technique::standard ? "default" : technique == Technique::seed ? "seed" : "seed-disk";
}

}  // namespace gonio
