#include "server/show/followed_show.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include <algorithm>
#include <set>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/state.pb.h"
#include "protocol/text/shortened_text.h"
#include "server/assets/assets.h"
#include "server/base/sha256.h"
#include "server/scene/light_tables.h"
#include "server/scene/light_values.h"
#include "server/scene/limits.h"
#include "server/scene/scene.h"
#include "server/show/safe_path.h"
#include "server/show/saved_imported.h"
#include "server/show/saved_profile.h"
#include "server/show/show_restorer.h"

namespace gonio {
namespace {

struct PartRow {
    ShowPart part;
    const char* name;  // on the wire
    Revision (*rev)(const Scene& scene);
};

template <Revision Scene::*rev>
Revision of(const Scene& scene) {
    return scene.*rev;
}

constexpr PartRow kParts[] = {
    {ShowPart::scene, "scene", of<&Scene::geometry_rev>},
    {ShowPart::lights, "lights", of<&Scene::lights_rev>},
    {ShowPart::values, "values",
     [](const Scene& scene) {
         Revision newest = 0;
         for (const Light& light : scene.lights) newest = std::max(newest, newest_rev(light));
         return newest;
     }},
    {ShowPart::groups, "groups", of<&Scene::groups_rev>},
    {ShowPart::presets, "presets", [](const Scene& scene) { return std::max(scene.presets_rev, scene.cues_rev); }},
    {ShowPart::cue_play, "cue_play", of<&Scene::cue_play_rev>},
    {ShowPart::camera, "camera", of<&Scene::camera_rev>},
    {ShowPart::saved_views, "saved_views", of<&Scene::saved_views_rev>},
    {ShowPart::grids, "grids", of<&Scene::grids_rev>},
    {ShowPart::observers, "observers", of<&Scene::observers_rev>},
    {ShowPart::exposure, "exposure", of<&Scene::exposure_rev>},
    {ShowPart::view, "view", of<&Scene::view_rev>},
    {ShowPart::look, "look", of<&Scene::look_rev>},
    {ShowPart::haze, "haze", of<&Scene::haze_rev>},
    {ShowPart::master, "master", of<&Scene::master_rev>},
    {ShowPart::technique, "technique", of<&Scene::technique_rev>},
    {ShowPart::size, "size", of<&Scene::size_rev>},
    {ShowPart::patch, "patch", of<&Scene::patch_rev>},
    {ShowPart::surfaces, "surfaces", of<&Scene::surfaces_rev>},
    {ShowPart::file, "file", of<&Scene::scene_rev>},
};
static_assert(std::size(kParts) == kShowParts);

constexpr double kMostFileBytes = 9007199254740992.0;  // 2^53: whole numbers up to here are exact

Error bad(const char* field, const std::string& value, std::string message) {
    return {"bad_message", std::string("followed.") + field, shortened_text(value, 80), std::move(message)};
}

// ---- lights

// Which light of the scene's file each light of the show is: an index, or -1.
std::vector<int> seeds_of(const saved::Show& show, const SceneAsset& asset) {
    std::map<std::string, int> free;
    for (const LightSeed& seed : asset.lights) free.emplace(seed.name, &seed - asset.lights.data());
    for (const std::string& removed : show.removed_lights()) free.erase(removed);
    std::vector<int> seeds(static_cast<std::size_t>(show.lights_size()), -1);
    for (const bool renamed : {true, false})  // those first, whose old name another may have by now
        for (int i = 0; i < show.lights_size(); ++i) {
            const saved::Light& light = show.lights(i);
            if (light.scene_name().empty() == renamed) continue;
            const auto seed = free.find(renamed ? light.scene_name() : light.name());
            if (seed == free.end()) continue;
            seeds[static_cast<std::size_t>(i)] = seed->second;
            free.erase(seed);
        }
    return seeds;
}

// Sets lights one at a time on a scene of its own, so that its values are checked as a command's and no other light
// costs time.
class LightStage {
public:
    explicit LightStage(ShowRestorer& restorer) : restorer_(restorer) {
        stage_.asset = restorer.scene().asset;
        stage_.gels = restorer.scene().gels;
        stage_.scene_rev = restorer.scene().scene_rev;
    }
    // before: the light as it was; null: it is new. Result: null where it cannot be.
    std::unique_ptr<Light> set(const Light* before, const saved::Light& saved) {
        const std::string what = "light '" + saved.name() + "'";
        stage_.lights.clear();
        if (before == nullptr) {
            restorer_.add(stage_, saved, what);
            if (stage_.lights.empty()) return nullptr;
            return std::make_unique<Light>(std::move(stage_.lights.front()));
        }
        stage_.lights.push_back(*before);
        Light& light = stage_.lights.front();
        // First: a sun takes no profile, and the aim goes by the mount.
        if (light.seed < 0 && restorer_.restore_kind(light, saved, what))
            light.profile_rev = light.aim_rev = stage_.scene_rev + 1;
        if (light.name != saved.name()) {
            v1::Command rename;
            rename.mutable_rename_light()->set_name(light.name);
            rename.mutable_rename_light()->set_new_name(saved.name());
            restorer_.run(stage_, rename, {}, "the name of " + what);
        }
        const Loaded loaded{.profile = restorer_.profile_of(saved)};
        if (!loaded.profile) restorer_.warn("the profile of " + what + " is missing");
        v1::Command command;
        v1::SetLight& set = *command.mutable_set_light();
        restorer_.fill(set, saved, what);
        if (saved.opening().empty() && !stage_.lights.front().sun) set.set_opening("file");
        restorer_.run(stage_, command, loaded, what);
        Light& changed = stage_.lights.front();
        const double multiplier = saved.has_multiplier() ? saved.multiplier() : 1.0;
        if (changed.seed < 0 && changed.multiplier != multiplier) {
            changed.multiplier = multiplier;
            changed.level_rev = stage_.scene_rev + 1;
        }
        return std::make_unique<Light>(std::move(changed));
    }

private:
    ShowRestorer& restorer_;
    Scene stage_;
};

// All lights, in their order. A light that was there keeps its id, while ids ascend.
void follow_lights(ShowRestorer& restorer, const saved::Show& show, bool same_asset) {
    Scene& scene = restorer.scene();
    const Revision now = scene.scene_rev + 1;
    const std::vector<int> seeds = seeds_of(show, *scene.asset);
    std::map<int, const Light*> by_seed;
    std::map<std::string, const Light*> by_name;
    if (same_asset)
        for (const Light& light : scene.lights)
            light.seed >= 0 ? (void)by_seed.emplace(light.seed, &light) : (void)by_name.emplace(light.name, &light);
    const Scene fresh = scene_of(scene.asset, now);
    LightStage stage(restorer);
    std::vector<Light> lights;
    std::set<std::string> names;
    std::uint32_t last_id = 0;
    for (int i = 0; i < show.lights_size() && lights.size() < kMaxLights; ++i) {
        const saved::Light& saved = show.lights(i);
        const int seed = seeds[static_cast<std::size_t>(i)];
        const Light* before = nullptr;
        if (const auto at = by_seed.find(seed); at != by_seed.end()) before = at->second;
        if (const auto at = by_name.find(saved.name()); seed < 0 && at != by_name.end()) before = at->second;
        const bool there = before != nullptr;
        if (!there && seed >= 0 && static_cast<std::size_t>(seed) < fresh.lights.size())
            before = &fresh.lights[static_cast<std::size_t>(seed)];
        const auto light = stage.set(before, saved);
        if (!light) continue;
        if (!names.insert(light->name).second) {
            restorer.warn("there are two lights '" + light->name + "'");
            continue;
        }
        if (!there || light->id <= last_id) {
            light->id = std::max(scene.next_light_id, last_id + 1);
            scene.next_light_id = light->id + 1;
            light->position_rev = light->aim_rev = light->profile_rev = light->level_rev = light->name_rev = now;
        }
        last_id = light->id;
        lights.push_back(std::move(*light));
    }
    if (show.lights_size() > static_cast<int>(kMaxLights)) restorer.warn("there are too many lights");
    const bool same = std::ranges::equal(
        lights, scene.lights, [](const Light& a, const Light& b) { return a.id == b.id && a.name == b.name; });
    scene.lights = std::move(lights);
    if (!same) scene.lights_rev = now;
    if (!show.imported()) scene.imported = nullptr;
    restore_imported(show, scene);
}

void follow_values(ShowRestorer& restorer, const saved::Show& show) {
    LightStage stage(restorer);
    for (const saved::Light& saved : show.lights()) {
        Light* const light = find_light(restorer.scene(), saved.name());
        if (light == nullptr)
            restorer.warn("there is no light '" + saved.name() + "'");
        else if (auto changed = stage.set(light, saved))
            *light = std::move(*changed);
    }
}

// ---- the other parts

bool equal(const Camera& a, const Camera& b) {
    return a.eye == b.eye && a.target == b.target && a.fov_rad == b.fov_rad;
}

// Puts parts to what they are without a show, so that what is told is all there is of them.
void clear(Scene& scene, const ShowParts& parts) {
    const Scene none;
    if (parts.has(ShowPart::groups)) scene.groups.clear();
    if (parts.has(ShowPart::presets)) scene.presets.clear(), scene.recalled.clear(), scene.cues = nullptr;
    if (parts.has(ShowPart::cue_play)) {
        scene.cue_options = {};
        scene.cue_active = scene.cue_next = 0;
    }
    if (parts.has(ShowPart::saved_views)) scene.saved_views.clear();
    if (parts.has(ShowPart::grids)) scene.grids.clear();
    if (parts.has(ShowPart::observers)) scene.observers.clear();
    if (parts.has(ShowPart::view)) {
        scene.view_light.clear();
        scene.view_only.clear();
        scene.view_compare.clear();
        scene.false_color = none.false_color;
    }
    if (parts.has(ShowPart::size)) scene.width_px = scene.height_px = 16;  // all lights fit whatever the technique is
    if (parts.has(ShowPart::patch)) scene.patch = nullptr;
    if (parts.has(ShowPart::surfaces)) scene.surfaces = nullptr;
}

void restore(ShowRestorer& restorer, const ShowParts& parts, const saved::Show& show) {
    struct Step {
        ShowPart part;
        void (ShowRestorer::*restore)();
    };
    constexpr Step kSteps[] = {
        {ShowPart::groups, &ShowRestorer::restore_groups},
        {ShowPart::presets, &ShowRestorer::restore_presets},
        {ShowPart::cue_play, &ShowRestorer::restore_cue_options},
        {ShowPart::saved_views, &ShowRestorer::restore_saved_views},
        {ShowPart::grids, &ShowRestorer::restore_grids},
        {ShowPart::observers, &ShowRestorer::restore_observers},
        {ShowPart::camera, &ShowRestorer::restore_camera},
        {ShowPart::technique, &ShowRestorer::restore_technique},
        {ShowPart::size, &ShowRestorer::restore_size},
        {ShowPart::exposure, &ShowRestorer::restore_exposure},
        {ShowPart::haze, &ShowRestorer::restore_haze},
        {ShowPart::look, &ShowRestorer::restore_look},
        {ShowPart::view, &ShowRestorer::restore_false_colors},
        {ShowPart::view, &ShowRestorer::restore_view},
        {ShowPart::view, &ShowRestorer::restore_view_lights},
        {ShowPart::master, &ShowRestorer::restore_master},
        {ShowPart::patch, &ShowRestorer::restore_patch},
        {ShowPart::surfaces, &ShowRestorer::restore_surfaces},
    };
    for (const Step& step : kSteps)
        if (parts.has(step.part)) (restorer.*step.restore)();
    Scene& scene = restorer.scene();
    if (parts.has(ShowPart::presets) && (show.recalled().empty() || scene.presets.contains(show.recalled())))
        scene.recalled = show.recalled();
}

// What was told has the revision; of what a picture is made from only what is another than before.
void stamp(Scene& scene, const Scene& before, const ShowParts& parts, bool anew) {
    const Revision now = scene.scene_rev + 1;
    const auto differs = [&](ShowPart part, bool same, Revision Scene::*rev) {
        if (parts.has(part)) scene.*rev = same && !anew ? before.*rev : now;
    };
    differs(ShowPart::groups, false, &Scene::groups_rev);
    differs(ShowPart::presets, false, &Scene::presets_rev);
    differs(ShowPart::presets, false, &Scene::cues_rev);
    differs(ShowPart::presets, scene.view_compare.empty(), &Scene::compare_rev);
    differs(ShowPart::cue_play, false, &Scene::cue_play_rev);
    differs(ShowPart::saved_views, false, &Scene::saved_views_rev);
    differs(ShowPart::grids, false, &Scene::grids_rev);
    differs(ShowPart::observers, false, &Scene::observers_rev);
    differs(ShowPart::patch, false, &Scene::patch_rev);
    differs(ShowPart::surfaces, false, &Scene::surfaces_rev);
    differs(ShowPart::camera, equal(scene.camera, before.camera), &Scene::camera_rev);
    differs(ShowPart::exposure,
            scene.exposure_ev100 == before.exposure_ev100 && scene.exposure_auto == before.exposure_auto,
            &Scene::exposure_rev);
    differs(ShowPart::view,
            scene.view == before.view && scene.view_gain == before.view_gain && scene.view_light == before.view_light &&
                scene.false_color == before.false_color && scene.view_only == before.view_only &&
                scene.view_compare == before.view_compare && scene.work_light == before.work_light,
            &Scene::view_rev);
    differs(ShowPart::look, scene.look == before.look, &Scene::look_rev);
    differs(ShowPart::haze, scene.haze == before.haze, &Scene::haze_rev);
    differs(ShowPart::master, scene.master_ratio == before.master_ratio, &Scene::master_rev);
    differs(ShowPart::technique, scene.technique == before.technique && scene.samples == before.samples,
            &Scene::technique_rev);
    differs(ShowPart::size, scene.width_px == before.width_px && scene.height_px == before.height_px, &Scene::size_rev);
}

}  // namespace

v1::Followed followed_of(const Scene& scene, const std::string& boot, Revision since, ProfileTexts& texts) {
    v1::Followed followed;
    followed.set_boot(boot);
    followed.set_scene_rev(scene.scene_rev);
    followed.set_since_rev(since);
    ShowParts parts;
    for (const PartRow& row : kParts)
        if (row.part == ShowPart::file || row.rev(scene) > since) parts.put(row.part);
    if (parts.has(ShowPart::lights)) parts.reset(static_cast<std::size_t>(ShowPart::values));
    for (const PartRow& row : kParts)
        if (parts.has(row.part)) followed.add_parts(row.name);
    saved::Show show = show_of(scene, texts, parts, since);
    for (saved::Profile& profile : *show.mutable_profiles()) profile.clear_photometry(), profile.clear_gobos();
    show.SerializeToString(followed.mutable_show());
    if (parts.has(ShowPart::scene) && scene.asset->files)
        for (const AssetFile& file : scene.asset->files->files) {
            v1::SceneFile& told = *followed.add_files();
            told.set_path(file.path);
            told.set_sha256(file.sha256);
            told.set_bytes(static_cast<double>(file.bytes));
        }
    return followed;
}

std::string show_hash(const Scene& scene, ProfileTexts& texts) {
    ShowParts parts;
    parts.set();
    parts.reset(static_cast<std::size_t>(ShowPart::file));
    saved::Show show = show_of(scene, texts, parts, 0, true);
    texts.forget_unused();  // they would keep profiles that the scene has no more
    show.clear_scene_rev();
    std::string files;
    if (scene.asset->files)
        for (const AssetFile& file : scene.asset->files->files) files += file.path + '\0' + file.sha256 + '\n';
    if (!files.empty()) show.set_scene(files);
    std::string bytes;
    {
        google::protobuf::io::StringOutputStream stream(&bytes);
        google::protobuf::io::CodedOutputStream coded(&stream);
        coded.SetSerializationDeterministic(true);
        show.SerializeToCodedStream(&coded);
    }
    return sha256(bytes);
}

Result<FollowedShow> read_followed(const v1::Followed& followed) {
    FollowedShow read;
    read.boot = followed.boot();
    read.rev = followed.scene_rev();
    read.since = followed.since_rev();
    if (read.boot.empty() || read.boot.size() > 64) return bad("boot", read.boot, "must have 1 to 64 bytes");
    if (read.rev == 0) return bad("scene_rev", "0", "is no revision");
    for (const std::string& name : followed.parts()) {
        const auto row = std::ranges::find_if(kParts, [&](const PartRow& one) { return name == one.name; });
        if (row == std::end(kParts)) return bad("parts", name, "is no part of a show that this version knows");
        read.parts.put(row->part);
    }
    if (!read.show.ParseFromString(followed.show())) return bad("show", "", "is no saved show");
    if (read.show.version() != kSavedVersion)
        return bad("show", std::to_string(read.show.version()), "is of another version of the program");
    if (read.show.profiles_size() > kMaxFollowedProfiles)
        return bad("show", std::to_string(read.show.profiles_size()), "has too many profiles");
    for (const saved::Profile& profile : read.show.profiles())
        if (!is_sha256(profile.key())) return bad("show", profile.key(), "a profile's key is a SHA-256");
    if (followed.files_size() > static_cast<int>(kMostAssetFiles))
        return bad("files", std::to_string(followed.files_size()), "are too many");
    std::set<std::string> paths;
    for (const v1::SceneFile& file : followed.files()) {
        if (!is_safe_path(file.path()) || !paths.insert(file.path()).second)
            return bad("files.path", file.path(), "must be a relative path of plain names, each once");
        if (!is_sha256(file.sha256())) return bad("files.sha256", file.sha256(), "must be a SHA-256");
        if (!(file.bytes() >= 0.0 && file.bytes() <= kMostFileBytes))
            return bad("files.bytes", print_number(file.bytes()), "must be a number from 0 to 2^53");
        read.files.push_back({file.path(), file.sha256(), static_cast<std::uint64_t>(file.bytes())});
    }
    if (read.parts.has(ShowPart::scene) && read.files.empty() != is_built_in(read.show.scene()))
        return bad("files", read.show.scene(), "the scene has no files, and is no built-in one");
    if (read.since == 0)
        for (const PartRow& row : kParts)
            if (row.part != ShowPart::values && !read.parts.has(row.part))
                return bad("parts", row.name, "is missing in what shall be the whole show");
    return read;
}

Result<std::shared_ptr<const Profile>> followed_profile(const std::string& content, bool uploaded) {
    const std::size_t name = content.find('\0');
    if (name == std::string::npos) return bad("show", "", "a profile has no name");
    const std::string_view rest = std::string_view(content).substr(name + 1);
    const std::size_t gate = rest.find('\0');
    const auto read = make_profile(content.substr(0, name), rest.substr(0, gate));
    if (!read) return read;
    auto own = std::make_shared<Profile>(**read);
    own->uploaded = uploaded;
    if (gate != rest.npos) {
        saved::Profile saved;
        std::vector<std::string> warnings;
        if (!saved.ParseFromString(std::string(rest.substr(gate + 1)))) return bad("show", "", "a wheel is none");
        take_gate(saved, *own, warnings);
        if (!warnings.empty()) return bad("show", "", warnings.front());
    }
    return std::shared_ptr<const Profile>(std::move(own));
}

RestoredShow follow_show(const Scene& before, const FollowedShow& followed, const FetchedParts& fetched, bool anew) {
    Scene scene;
    if (anew)
        scene.gels = before.gels, scene.next_light_id = before.next_light_id;
    else
        scene = before;
    const ShowParts& parts = followed.parts;
    const saved::Show& show = followed.show;
    scene.scene_rev = followed.rev - 1;  // what changes now has the revision after it
    const bool same_asset = !anew && (!parts.has(ShowPart::scene) || fetched.asset == before.asset);
    if (!same_asset) {
        scene.asset = fetched.asset;
        scene.traced = fetched.traced;
        scene.drawn = fetched.drawn;
        scene.geometry_rev = followed.rev;
    }
    const std::string compare = scene.view_compare;
    const Revision view_rev = scene.view_rev;
    clear(scene, parts);
    ShowRestorer restorer(show, std::move(scene));
    restorer.keep_revision();
    restorer.set_profiles(fetched.profiles);
    if (parts.has(ShowPart::lights))
        follow_lights(restorer, show, same_asset);
    else if (parts.has(ShowPart::values))
        follow_values(restorer, show);
    restore(restorer, parts, show);
    Scene& now = restorer.scene();
    if (!parts.has(ShowPart::view)) {  // presets that came made it think that the one it compares with was gone
        now.view_compare = compare;
        now.view_rev = view_rev;
    }
    stamp(now, before, parts, anew);
    now.scene_rev = now.edited_rev = followed.rev;
    if (parts.has(ShowPart::file)) {
        now.show_name = show.show_name();
        now.show_rev = show.show_unsaved() ? 0 : followed.rev;
    }
    return {std::move(now), std::move(restorer.warnings())};
}

}  // namespace gonio
