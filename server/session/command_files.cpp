#include "server/session/command_files.h"

#include <filesystem>
#include <utility>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/scene.pb.h"
#include "protocol/schema/upload_name.h"
#include "protocol/text/shortened_text.h"
#include "server/assets/assets.h"
#include "server/base/bounded_file.h"
#include "server/base/memory_room.h"
#include "server/base/sha256.h"
#include "server/exchange/import_luminaire.h"
#include "server/exchange/import_mvr.h"
#include "server/lighting/clusters.h"
#include "server/scene/cue.h"
#include "server/scene/light_tables.h"
#include "server/scene/limits.h"
#include "server/scene/scene.h"
#include "server/show/held_files.h"
#include "server/show/saved_show.h"
#include "server/show/show_folder.h"
#include "server/trace/exposure.h"
#include "server/trace/first_view.h"
#include "server/trace/geometry.h"

namespace gonio {

static const v1::Profile* profile_of(const v1::Command& command) {
    if (command.has_set_light() && command.set_light().has_profile()) return &command.set_light().profile();
    if (command.has_add_light() && command.add_light().light().has_profile())
        return &command.add_light().light().profile();
    if (command.has_edit_lights() && command.edit_lights().same().has_profile())
        return &command.edit_lights().same().profile();
    return nullptr;
}

bool needs_files(const v1::Command& command) {
    return command.has_load_scene() || command.has_open_show() || profile_of(command) != nullptr;
}

// What takes long of a scene, and is made beside it.
static void prepare(Loaded& loaded, std::shared_ptr<const SceneAsset> asset) {
    loaded.traced = std::make_shared<const trace::Geometry>(std::move(asset));
    loaded.drawn = lighting::make_drawn(loaded.traced, true);
}

// The first picture of a scene: where it is taken from, how it is exposed, and what is wrong with what it shows.
static void look_at_first(Loaded& loaded, bool keeps_camera) {
    Scene scene = scene_of(loaded.asset);
    scene.traced = loaded.traced;
    std::string hint = trace::take_first_view(scene);
    if (!hint.empty() && !keeps_camera) loaded.warnings.push_back(std::move(hint));
    loaded.camera = scene.camera;
    if (!loaded.asset->exposure_ev100) loaded.exposure_ev100 = trace::metered_ev100(scene);
}

// The scene of a show: from the files that it holds, else from where it says they are.
// Errors: of unpack_files, scene_path and load_scene.
static Result<std::shared_ptr<const SceneAsset>> read_scene_of(const saved::Show& show, const std::string& given,
                                                               const SceneAccess& access,
                                                               std::vector<std::string>& warnings) {
    LoadOptions load = access.load;
    load.scale = show.scene_scale() == 0.0 ? 1.0 : show.scene_scale();
    if (show.has_scene_universe_offset()) load.universe_offset = show.scene_universe_offset();
    const auto path = scene_path(access, show.scene());
    if (show.files().empty() || show.files(0).content().empty()) {
        auto asset =
            !path ? path.error() : exchange::load_any_scene(*path, show.scene(), load, memory_room(access.max_memory));
        if (asset || is_built_in(show.scene())) return asset;
        const Error& error = asset.error();
        return Error{error.code, "open_show.name", shortened_text(given, 80),
                     "The show does not hold the file of its scene, '" + shortened_text(show.scene(), 200) +
                         "', and here it cannot be read: " + error.text()};
    }
    const auto folder = unpack_files(show, access.upload_folder);
    if (!folder) return Error{folder.error().code, "open_show.name", given, folder.error().text()};
    const std::string own = (*folder)->path() + "/" + show.files(0).path();
    auto asset = exchange::load_any_scene(own, show.scene(), load, memory_room(access.max_memory));
    if (!asset) return asset;
    if (path)
        if (const FileDigest here = sha256_of_file(*path);
            !here.sha256.empty() && here.sha256 != show.files(0).sha256())
            warnings.push_back("the scene is the copy that the show holds: '" + shortened_text(show.scene(), 200) +
                               "' on this server is another one by now");
    return with_folder(std::move(*asset), *folder);
}

// Errors: of checked_show_name, read_show_file, read_show and read_scene_of.
static Result<Loaded> read_opened(const std::string& given, const SceneAccess& access) {
    const std::string where = "open_show.name";
    Result<std::string> text = std::string();
    std::string show_name;
    if (given.starts_with(kUploadPrefix)) {
        const auto path = scene_path(access, given);
        if (!path) return path.error();
        text = read_bounded_file(*path, kMaxSavedBytes);
    } else {
        const auto name = checked_show_name(given, where);
        if (!name) return name.error();
        show_name = *name;
        text = read_show_file(access.show_folder, *name, kMaxSavedBytes);
    }
    if (!text) return text.error();
    auto show = read_show(*text);
    text->clear();
    text->shrink_to_fit();
    if (!show) return Error{show.error().code, where, given, show.error().text()};
    std::vector<std::string> warnings;
    const auto asset = read_scene_of(*show, given, access, warnings);
    if (!asset) return asset.error();
    show->clear_files();  // they are on the disk
    RestoredShow restored = restore_show(*show, *asset, true, kProfileTime, access.gels);
    restored.warnings.insert(restored.warnings.begin(), warnings.begin(), warnings.end());
    Loaded loaded;
    prepare(loaded, *asset);
    restored.scene.show_name = show_name;
    restored.scene.traced = loaded.traced;
    restored.scene.drawn = loaded.drawn;
    loaded.opened = std::make_shared<const Scene>(std::move(restored.scene));
    loaded.warnings = std::move(restored.warnings);
    if (loaded.warnings.size() > kMostOpenWarnings) {
        const std::size_t more = loaded.warnings.size() - kMostOpenWarnings;
        loaded.warnings.resize(kMostOpenWarnings);
        loaded.warnings.push_back("and " + std::to_string(more) + " more");
    }
    return loaded;
}

static Result<std::shared_ptr<const Profile>> read_profile(const v1::Profile& profile, Library* library) {
    const std::string& bytes = profile.photometry();
    if (!profile.has_photometry()) return library ? library->profile(profile.name()) : builtin_profile(profile.name());
    if (bytes.size() > kMaxProfileBytes)
        return Error{"too_large", "profile.photometry", std::to_string(bytes.size()) + " bytes",
                     "a profile may have at most 1 MiB"};
    const auto read = exchange::read_luminaire(shortened_text(profile.name(), kMaxNameBytes), bytes);
    if (!read) return read;
    auto own = std::make_shared<Profile>(**read);
    own->uploaded = true;
    if (library) library->keep_upload(own);
    return std::shared_ptr<const Profile>(std::move(own));
}

static std::vector<std::shared_ptr<const Profile>> profiles_of(const SceneAsset& asset) {
    std::vector<std::shared_ptr<const Profile>> profiles;
    for (const LightSeed& light : asset.lights) profiles.push_back(light.profile);
    return profiles;
}

// What the scene's file brings, and what the show's lights, presets and cues have beside it.
std::vector<std::shared_ptr<const Profile>> profiles_of(const Scene& scene) {
    std::vector<std::shared_ptr<const Profile>> profiles = profiles_of(*scene.asset);
    for (const Light& light : scene.lights) profiles.push_back(light.profile);
    const auto add = [&](const Preset& preset) {
        for (const PresetLight& light : preset) profiles.push_back(light.profile);
    };
    for (const auto& [name, preset] : scene.presets) add(*preset);
    if (scene.cues)
        for (const auto& cue : *scene.cues) add(*cue->content);
    return profiles;
}

// An upload stays as it is while its scene is there, also where another file takes its name: undo and saving need it.
static Result<std::shared_ptr<const SceneAsset>> read_scene(const std::string& path, const std::string& file,
                                                            const LoadOptions& load, const SceneAccess& access) {
    const std::size_t room = memory_room(access.max_memory);
    if (!file.starts_with(kUploadPrefix)) return exchange::load_any_scene(path, file, load, room);
    const std::string name = file.substr(kUploadPrefix.size());
    const auto linked = link_files(access.upload_folder, name);
    const std::string own = linked ? (*linked)->path() + "/" + name : "";
    std::error_code failed;
    if (!linked || !std::filesystem::is_regular_file(own, failed))  // the disk knows no second names
        return exchange::load_any_scene(path, file, load, room);
    auto asset = exchange::load_any_scene(own, file, load, room);
    return asset ? with_folder(std::move(*asset), *linked) : std::move(asset);
}

Result<Loaded> read_files(const v1::Command& command, const SceneAccess& access, Library* library) {
    if (command.has_open_show()) {
        Result<Loaded> loaded = read_opened(command.open_show().name(), access);
        if (loaded && library) library->keep_scene(profiles_of(*loaded->opened));
        return loaded;
    }
    Loaded loaded;
    if (command.has_load_scene()) {
        const std::string& file = command.load_scene().file();
        const double scale = command.load_scene().has_scale() ? command.load_scene().scale() : 1.0;
        const auto path = scene_path(access, file);
        if (!path) return path.error();
        LoadOptions load = access.load;
        load.scale = scale;
        load.universe_offset = command.load_scene().universe_offset();
        auto asset = read_scene(*path, file, load, access);
        if (!asset) return asset.error();
        loaded.asset = *asset;
        if (command.load_scene().dry_run()) return loaded;
        if (library) library->keep_scene(profiles_of(**asset));
        prepare(loaded, *asset);
        const auto& keep = command.load_scene().keep();
        if (!command.load_scene().merge()) look_at_first(loaded, std::ranges::find(keep, "views") != keep.end());
    }
    if (const v1::Profile* profile = profile_of(command)) {
        auto read = read_profile(*profile, library);
        if (!read) return read.error();
        loaded.profile = *read;
        tables_of(*loaded.profile);
    }
    return loaded;
}

}  // namespace gonio
