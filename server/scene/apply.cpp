#include "server/scene/apply.h"

#include <algorithm>

#include "protocol/dmx/patch.h"
#include "protocol/schema/command.pb.h"
#include "protocol/schema/console.pb.h"
#include "protocol/schema/cue.pb.h"
#include "protocol/schema/scene.pb.h"
#include "protocol/schema/surface.pb.h"
#include "protocol/surface/surface_map.h"
#include "server/scene/apply_camera.h"
#include "server/scene/apply_checks.h"
#include "server/scene/apply_cues.h"
#include "server/scene/apply_grid.h"
#include "server/scene/apply_haze.h"
#include "server/scene/apply_light.h"
#include "server/scene/apply_load.h"
#include "server/scene/apply_rename.h"
#include "server/scene/apply_show.h"
#include "server/scene/apply_targets.h"
#include "server/scene/apply_view.h"
#include "server/scene/console.h"
#include "server/scene/cue.h"
#include "server/scene/gel.h"
#include "server/scene/imported.h"
#include "server/scene/light_tables.h"
#include "server/scene/light_values.h"
#include "server/scene/limits.h"
#include "server/scene/packed_gobo.h"
#include "server/scene/preset.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

double checked_as(Property property, double value, const std::string& field) {
    return checked(value, row_of(property).least, row_of(property).most, field);
}

constexpr const char* kViewNames[] = {"beauty", "direct",    "indirect",   "illuminance", "luminance",
                                      "mask",   "rsm-depth", "rsm-normal", "rsm-flux",    "solid"};

constexpr const char* kTechniqueNames[] = {"default", "seed", "seed-disk"};

// names: of the enumerators, in their order. Result: whether `name` is among them; then `value` is its enumerator.
template <typename Enum, typename Names>
bool parse_name(const Names& names, const std::string& name, Enum& value) {
    const auto at = std::ranges::find(names, name);
    if (at == std::end(names)) return false;
    value = static_cast<Enum>(at - std::begin(names));
    return true;
}

void set_technique(Scene& scene, const v1::SetTechnique& set) {
    Technique technique = scene.technique;
    if (!set.technique().empty() && !parse_name(kTechniqueNames, set.technique(), technique)) {
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

void set_size(Scene& scene, const v1::SetSize& set) {
    const int width = static_cast<int>(checked(set.width_px(), 16, 4096, "set_size.width_px"));
    const int height = static_cast<int>(checked(set.height_px(), 16, 4096, "set_size.height_px"));
    if (width % 2 != 0) refuse("invalid_argument", "set_size.width_px", std::to_string(width), "must be even");
    if (height % 2 != 0) refuse("invalid_argument", "set_size.height_px", std::to_string(height), "must be even");
    change(scene, scene.width_px, width, scene.size_rev);
    change(scene, scene.height_px, height, scene.size_rev);
    change(scene, scene.size_auto, false, scene.size_rev);
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
    note_preset(scene, name);
    if (loaded.preset) {  // read from a file: the lights do not show it
        scene.presets[name] = loaded.preset;
        return;
    }
    scene.presets[name] = std::make_shared<const Preset>(preset_of(scene));
    scene.recalled = name;
}

void remove_preset(Scene& scene, const std::string& name) {
    if (scene.presets.erase(name) == 0) refuse_unknown("remove_preset.name", name, "preset", scene.presets);
    if (scene.recalled == name) scene.recalled.clear();
    note_preset(scene, name);
    scene.presets_rev = scene.scene_rev + 1;
}

void recall_preset(Scene& scene, const v1::RecallPreset& recall) {
    const auto preset = scene.presets.find(recall.name());
    if (preset == scene.presets.end()) refuse_unknown("recall_preset.name", recall.name(), "preset", scene.presets);
    const bool fades = checked(recall.fade_s(), 0.0, kMaxFade_s, "recall_preset.fade_s") > 0;
    bring_about(scene, *preset->second, fades);
    change(scene, scene.recalled, recall.name(), scene.presets_rev);
}

void dispatch(Scene& scene, const v1::Command& command, const Loaded& loaded, std::vector<std::string>& warnings) {
    switch (command.command_case()) {
        case v1::Command::kLoadScene:
            return load_scene(scene, command.load_scene(), loaded, warnings);
        case v1::Command::kOpenShow:
            return open_show(scene, command.open_show(), loaded);
        case v1::Command::kSetTechnique:
            return set_technique(scene, command.set_technique());
        case v1::Command::kSetView:
            return set_view(scene, command.set_view());
        case v1::Command::kSetExposure:
            return set_exposure(scene, command.set_exposure());
        case v1::Command::kSetHaze:
            return set_haze(scene, command.set_haze());
        case v1::Command::kSetLook:
            return set_look(scene, command.set_look());
        case v1::Command::kSetMaster:
            if (command.set_master().has_ratio()) {
                change(scene, scene.master_ratio,
                       checked_as(Property::master, command.set_master().ratio(), "set_master.ratio"),
                       scene.master_rev);
            }
            return;
        case v1::Command::kSetLight:
            return set_light(scene, command.set_light(), loaded);
        case v1::Command::kSetCamera:
            return set_camera(scene, command.set_camera());
        case v1::Command::kSaveView:
            return save_view(scene, command.save_view());
        case v1::Command::kRecallView:
            return recall_view(scene, command.recall_view().name());
        case v1::Command::kRemoveView:
            return remove_view(scene, command.remove_view().name());
        case v1::Command::kAddLight:
            return add_light(scene, command.add_light(), loaded);
        case v1::Command::kEditLights:
            return edit_lights(scene, command.edit_lights(), loaded);
        case v1::Command::kRemoveLight:
            return remove_light(scene, command.remove_light().name());
        case v1::Command::kRecessLight:  // it takes rays: the session has made an edit_lights of it
            refuse("unsupported", "recess_light.name", command.recess_light().name(), "rays cannot be cast here");
        case v1::Command::kRenameLight:
            return rename_light(scene, command.rename_light(), warnings);
        case v1::Command::kUndo:
        case v1::Command::kRedo:
            if (loaded.opened) return come_back(scene, *loaded.opened);
            if (!loaded.targets) refuse("unsupported", "command", "", "only a client can undo and redo");
            return set_back(scene, *loaded.targets, warnings);
        case v1::Command::kSetPatch:
            return set_patch(scene, command.set_patch());
        case v1::Command::kSavePreset:
            return save_preset(scene, command.save_preset().name(), loaded);
        case v1::Command::kRecallPreset:
            return recall_preset(scene, command.recall_preset());
        case v1::Command::kRemovePreset:
            return remove_preset(scene, command.remove_preset().name());
        case v1::Command::kAddCue:
            return add_cue(scene, command.add_cue(), loaded);
        case v1::Command::kSetCue:
            return set_cue(scene, command.set_cue());
        case v1::Command::kRemoveCue:
            return remove_cue(scene, command.remove_cue().number());
        case v1::Command::kSetCueOptions:
            return set_cue_options(scene, command.set_cue_options());
        case v1::Command::kCueGo:
        case v1::Command::kCueBack:
        case v1::Command::kCueStop:
        case v1::Command::kCueGoto:
        case v1::Command::kCueAssert:
            return play_cue(scene, command, loaded);
        case v1::Command::kSetSurfaces:
            return set_surfaces(scene, command.set_surfaces());
        case v1::Command::kMapControl:
            return map_control(scene, command.map_control());
        case v1::Command::kSetGrid:
            return set_grid(scene, command.set_grid().grid());
        case v1::Command::kRemoveGrid:
            return remove_grid(scene, command.remove_grid().name());
        case v1::Command::kSetObserver:
            return set_observer(scene, command.set_observer().observer());
        case v1::Command::kRemoveObserver:
            return remove_observer(scene, command.remove_observer().name());
        case v1::Command::kSetGroup:
            return set_group(scene, command.set_group());
        case v1::Command::kSetSize:
            return set_size(scene, command.set_size());
        case v1::Command::COMMAND_NOT_SET:
            break;
    }
    refuse("unsupported", "command", "", "this server does not know the command");
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

// Of what the show keeps.
Revision newest_show_part(const Scene& scene) {
    Revision newest = std::max({scene.geometry_rev, scene.master_rev, scene.lights_rev, scene.groups_rev,
                                scene.patch_rev, scene.surfaces_rev, scene.presets_rev, scene.saved_views_rev,
                                scene.grids_rev, scene.observers_rev, scene.haze_rev, scene.cues_rev});
    for (const Light& light : scene.lights) newest = std::max(newest, newest_rev(light));
    return newest;
}

Revision newest_part(const Scene& scene) {
    return std::max({newest_show_part(scene), scene.camera_rev, scene.view_rev, scene.exposure_rev, scene.technique_rev,
                     scene.size_rev, scene.look_rev, scene.cue_play_rev});
}

}  // namespace

Result<Applied> apply(Scene& scene, const v1::Command& command, const Loaded& loaded) {
    Scene changed = scene;
    Applied applied;
    try {
        dispatch(changed, command, loaded, applied.warnings);
        check_layers(changed);
        for (Light& light : changed.lights) follow_values(light);
    } catch (const Refused& refused) {
        return refused.error;
    }
    changed.scene_rev = std::max(scene.scene_rev, newest_part(changed));
    if (newest_show_part(changed) > scene.scene_rev) changed.edited_rev = changed.scene_rev;
    scene = std::move(changed);
    applied.scene_rev = scene.scene_rev;
    if (loaded.profile) {
        for (const ies::Diagnostic& d : loaded.profile->photometry.diagnostics) {
            applied.warnings.push_back(d.code + " (line " + std::to_string(d.line) + "): " + d.message);
        }
        const std::string thinned = known_thinned(*loaded.profile);
        if (!thinned.empty()) applied.warnings.push_back(thinned);
    }
    if (loaded.asset)
        applied.warnings.insert(applied.warnings.end(), loaded.asset->warnings.begin(), loaded.asset->warnings.end());
    if (loaded.opened) applied.warnings.clear();
    applied.warnings.insert(applied.warnings.end(), loaded.warnings.begin(), loaded.warnings.end());
    if (command.has_set_technique() && scene.technique != Technique::standard)
        for (const Light& light : scene.lights)
            if (light.sun) applied.warnings.push_back("the seed technique has no sun: '" + light.name + "' is dark");
    if (command.has_set_surfaces() || command.has_map_control()) applied.warnings = surface_warnings(scene);
    if (command.has_set_patch()) {
        const v1::Patch patch = patch_in_force(scene);
        applied.warnings.assign(patch.warnings().begin(), patch.warnings().end());
    }
    if (command.set_view().work_light())
        if (std::string why = why_no_work_light(scene); !why.empty()) applied.warnings.push_back(std::move(why));
    for (const Light& light : scene.lights)
        if (std::string failure = untold_failure(light); !failure.empty())
            applied.warnings.push_back(std::move(failure));
    return applied;
}

static std::optional<Error> apply_input(Scene& scene, const v1::Command& command) {
    if (command.has_set_light()) return set_light_in_parts(scene, command.set_light());
    if (!command.has_set_master() && !command.has_set_exposure() && !command.has_set_camera() &&
        !command.has_save_preset() && !command.has_recall_preset())
        return Error{"unsupported", "command", "", "a console cannot say this"};
    std::vector<std::string> unheard;
    try {
        dispatch(scene, command, {}, unheard);                   // each checks what it says before it changes anything
        for (Light& light : scene.lights) follow_values(light);  // a preset turns them
    } catch (const Refused& refused) {
        return refused.error;
    }
    return std::nullopt;
}

std::vector<std::optional<Error>> apply_inputs(Scene& scene, std::span<const v1::Command> commands, Driven driven) {
    const Revision before = scene.scene_rev;
    std::vector<std::optional<Error>> refused;
    for (const v1::Command& command : commands) refused.push_back(apply_input(scene, command));
    scene.scene_rev = std::max(scene.scene_rev, newest_part(scene));
    const bool saves = std::ranges::any_of(commands, [](const v1::Command& one) { return one.has_save_preset(); });
    if ((driven == Driven::by_hand || saves) && newest_show_part(scene) > before) scene.edited_rev = scene.scene_rev;
    return refused;
}

Camera framing(const Bounds& bounds) {
    const glm::dvec3 centre = (bounds.min + bounds.max) * 0.5;
    const double radius = std::max(glm::length(bounds.max - bounds.min) * 0.5, 1e-3);
    Camera camera;
    camera.target = centre;
    camera.eye = centre + glm::normalize(glm::dvec3(0.6, 0.45, 1.0)) * radius * 2.6;
    return camera;
}

Scene scene_of(std::shared_ptr<const SceneAsset> asset, Revision revision) {
    Scene scene;
    scene.scene_rev = scene.show_rev = scene.edited_rev = revision;
    scene.camera = scene.home = asset->cameras.empty() ? framing(asset->bounds) : asset->cameras.front();
    scene.exposure_ev100 = asset->exposure_ev100.value_or(scene.exposure_ev100);
    scene.patch = asset->patch;
    for (const LightSeed& seed : asset->lights) {
        if (scene.lights.size() == kMaxLights) break;  // the loader has warned
        Light light;
        light.id = scene.next_light_id++;
        light.name = seed.name;
        light.position = seed.position;
        light.world_from_light = glm::normalize(seed.world_from_light);
        light.world_from_mount = seed.world_from_mount;
        take_angles(light, seed.angles);
        light.profile = seed.profile;
        light.sun = seed.sun;
        light.level_ratio = seed.level_ratio;
        light.multiplier = seed.multiplier;
        light.color = seed.color;
        light.cct_k = seed.cct_k;
        light.tilt_factor = tilt_factor_of(light);
        light.seed = static_cast<int>(&seed - asset->lights.data());
        scene.lights.push_back(std::move(light));
    }
    renew_parts(scene, revision);
    scene.asset = std::move(asset);
    take_imported(scene);
    return scene;
}

double within_exposure(double ev100) {
    const PropertyRow& row = row_of(Property::exposure);
    return std::clamp(ev100, row.least, row.most);
}

glm::dvec3 light_weight(const Scene& scene, const Light& light) {
    return own_weight(light) * scene.master_ratio;
}

glm::dvec3 own_weight(const Light& light) {
    if (light.missing) return glm::dvec3(0.0);
    return light.color * filtered_white(light.cct_k, light.tint_duv, light.gel.get()) *
           (light.level_ratio * light.shutter_ratio * light.multiplier * light.tilt_factor *
            (light.strobe_hz > 0.0 && light.flash_off ? 0.0 : 1.0));
}

const char* view_name(View view) {
    return kViewNames[static_cast<int>(view)];
}

bool parse_view(const std::string& name, View& view) {
    return parse_name(kViewNames, name, view);
}

const char* technique_name(Technique technique) {
    return kTechniqueNames[static_cast<int>(technique)];
}

}  // namespace gonio
