#include "server/app/start.h"

#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include <spdlog/spdlog.h>

#include "protocol/dmx/patch_toml.h"
#include "protocol/schema/command.pb.h"
#include "protocol/schema/scene.pb.h"
#include "protocol/schema/undo_file.pb.h"
#include "protocol/schema/upload_name.h"
#include "protocol/surface/surface_toml.h"
#include "server/app/bake_job.h"
#include "server/app/oneshot.h"
#include "server/assets/assets.h"
#include "server/base/atomic_file.h"
#include "server/base/bounded_file.h"
#include "server/base/memory_room.h"
#include "server/base/sha256.h"
#include "server/exchange/import_mvr.h"
#include "server/lighting/clusters.h"
#include "server/lighting/isa.h"
#include "server/render/renderer.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "server/session/null_renderer.h"
#include "server/session/scene_access.h"
#include "server/show/held_files.h"
#include "server/show/state_file.h"
#include "server/show/undo_file.h"
#include "server/trace/exposure.h"
#include "server/trace/first_view.h"
#include "server/trace/geometry.h"

namespace gonio {
namespace {

// Result: what the file says. Throws std::invalid_argument. read: of its text.
template <typename Read>
auto read_file(const std::string& path, std::size_t most_bytes, const char* what, const Read& read) {
    const auto text = read_bounded_file(path, most_bytes);
    if (!text) throw std::invalid_argument("the " + std::string(what) + " '" + path + "' " + text.error().message);
    auto result = read(*text);
    if (!result) throw std::invalid_argument(path + ": " + result.error().text());
    return std::move(*result);
}

void apply_file(Scene& scene, const v1::Command& command, const std::string& path) {
    const auto applied = apply(scene, command, {});
    if (!applied) throw std::invalid_argument(path + ": " + applied.error().text());
    for (const std::string& warning : applied->warnings) spdlog::warn("{}: {}", path, warning);
}

void apply_option(Scene& scene, const v1::Command& command) {
    const auto applied = apply(scene, command, {});
    if (!applied) throw std::invalid_argument(applied.error().text());
}

// Not all of the state file is in the scene that is shown: what is saved next must not be the end of the rest.
void keep_show_aside(const std::string& path) {
    const auto aside = keep_file_aside(path, ".aside");
    if (!aside) throw std::invalid_argument(aside.error().text());
    spdlog::warn("state: the show that was saved is kept as {}", *aside);
}

void log_warnings(const SceneAsset& asset) {
    for (const std::string& warning : asset.warnings) spdlog::warn("{}: {}", asset.name, warning);
}

std::shared_ptr<const SceneAsset> asset_of(const Options& options) {
    const std::string& file = options.scene;
    auto asset = exchange::load_any_scene(file, "", options.load, memory_room(options.max_memory));
    if (!asset) throw std::invalid_argument("cannot load the scene '" + file + "': " + asset.error().text());
    log_warnings(**asset);
    return *asset;
}

// The scene of a saved show: an upload or a file below a --scene-root as clients name them, else any file. Errors: as
// of load_scene.
Result<std::shared_ptr<const SceneAsset>> saved_asset(const Options& options, const saved::Show& show, double scale) {
    const std::string& name = show.scene();
    LoadOptions load = options.load;
    load.scale = scale;
    if (show.has_scene_universe_offset()) {
        load.universe_offset = show.scene_universe_offset();
        if (const int asked = options.load.universe_offset; asked != 0 && asked != load.universe_offset)
            spdlog::warn(
                "state: '{}' was saved with the universe offset {}, which counts; --universe-offset asks for {}", name,
                load.universe_offset, asked);
    }
    if (!show.files().empty()) {
        const auto folder = unpack_files(show, "");
        if (folder) {
            auto asset = exchange::load_any_scene((*folder)->path() + "/" + show.files(0).path(), name, load,
                                                  memory_room(options.max_memory));
            return asset ? with_folder(std::move(*asset), *folder) : std::move(asset);
        }
        spdlog::warn("state: {}", folder.error().text());  // the scene's own file may be there
    }
    const bool upload = name.starts_with(kUploadPrefix);
    if (upload && options.upload_folder.empty())
        return Error{"not_found", "scene", name, "Uploads are kept where --upload-dir names a folder."};
    const auto path = scene_path({true, options.scene_roots, options.upload_folder, options.load, 0}, name);
    if (!path && upload) return path.error();
    return exchange::load_any_scene(path ? *path : name, name, load, memory_room(options.max_memory));
}

struct Restored {
    Scene scene;
    bool whole = true;  // it has everything that was saved
    bool same = false;  // it is the saved scene, as far as it came back
};

std::shared_ptr<const Gels> gels_of(const Options& options) {
    if (options.gel_file.empty()) return nullptr;
    return std::make_shared<const Gels>(read_file(options.gel_file, kMaxGelFileBytes, "gels", read_gels));
}

// Brings the saved show back, as far as it can be.
Restored saved_scene(const Options& options, const saved::Show& show, const std::shared_ptr<const Gels>& gels) {
    if (options.scene_given && !is_scene_of(show, options.scene)) {
        spdlog::warn("state: '{}' was saved, --scene asks for '{}'", show.scene(), options.scene);
        return {scene_of(asset_of(options), revision_after(show)), false};
    }
    const double saved_scale = show.scene_scale() == 0.0 ? 1.0 : show.scene_scale(),
                 scale = options.scale_given ? options.load.scale : saved_scale;
    auto asset = saved_asset(options, show, scale);
    if (asset) log_warnings(**asset);
    if (asset && scale != saved_scale) {  // its positions are another scene's
        spdlog::warn("state: '{}' was saved at scale {}, --scale asks for {}: lights, groups and camera are the file's",
                     show.scene(), saved_scale, scale);
        return {restore_show(show, *asset, false, kProfileTime, gels).scene, false};
    }
    const bool same_scene = static_cast<bool>(asset);
    if (!same_scene)
        spdlog::warn("state: the scene '{}' cannot be loaded: {}; '{}' is shown instead", show.scene(),
                     asset.error().text(), options.scene);
    RestoredShow restored = restore_show(show, same_scene ? *asset : asset_of(options), same_scene, kProfileTime, gels);
    for (const std::string& warning : restored.warnings) spdlog::warn("state: {}", warning);
    spdlog::info("state: restored from {}, revision {}", options.state_file, restored.scene.scene_rev);
    return {std::move(restored.scene), same_scene && restored.warnings.empty(), same_scene};
}

// What can be undone in the scene that came back; nothing where that cannot be told.
UndoRecord restored_undo(const Options& options, const std::string& state_sha256, Scene& scene) {
    std::string why;
    try {
        const auto file = read_undo_file(options.state_file, state_sha256);
        if (file && renew_ids(file->steps(), scene)) return record_of(*file, scene);
        why = file ? "the lights are not those of " + options.state_file + kUndoEnding : file.error().text();
    } catch (const std::exception& exception) {  // also where there is not enough memory
        why = exception.what();
    }
    spdlog::warn("state: nothing can be undone that was done before: {}", why);
    return {};
}

// Throws std::exception, which says why it cannot be read.
std::shared_ptr<const LeftScene> read_whole_left(const Options& options, const LeftScene& kept,
                                                 const std::shared_ptr<const Gels>& gels) {
    saved::Show show = kept.kept->show();
    const bool held = !show.files().empty();
    find_scene(options.state_file, show);
    if (held && show.files().empty())
        throw std::runtime_error("the files of the scene '" + show.scene() + "' are gone");
    auto asset = saved_asset(options, show, show.scene_scale() == 0.0 ? 1.0 : show.scene_scale());
    if (!asset) throw std::runtime_error(asset.error().text());
    show.clear_files();
    RestoredShow restored = restore_show(show, *asset, true, kProfileTime, gels);
    for (const std::string& warning : restored.warnings) spdlog::warn("state: {}", warning);
    Scene& scene = restored.scene;
    if (!renew_ids(kept.kept->steps(), scene)) throw std::runtime_error("its lights are others");
    scene.traced = std::make_shared<const trace::Geometry>(scene.asset);
    scene.drawn = lighting::make_drawn(scene.traced, true);
    auto left = std::make_shared<LeftScene>(kept);
    std::uint64_t used = 0;
    left->steps = steps_of(kept.kept->steps(), scene, used);
    left->scene = std::make_shared<const Scene>(std::move(scene));
    return left;
}

Renderer::DirectLight direct_light_of(const Options& options) {
    return options.direct_light == "gl"     ? Renderer::DirectLight::gl
           : options.direct_light == "rays" ? Renderer::DirectLight::rays
                                            : Renderer::DirectLight::automatic;
}

}  // namespace

SurfaceOptions surface_options(const Options& options) {
    SurfaceOptions surfaces;
    surfaces.on = options.surfaces;
    surfaces.midi = options.midi == "usb"    ? SurfaceOptions::Midi::usb
                    : options.midi == "alsa" ? SurfaceOptions::Midi::alsa
                                             : SurfaceOptions::Midi::automatic;
    for (const std::string& box : options.boxes) {  // VVVV:PPPP or VVVV:PPPP=PROFILE
        const std::string id = box.substr(0, box.find('='));
        surfaces.taken.push_back(id);
        if (id.size() < box.size()) surfaces.profiles[id] = box.substr(id.size() + 1);
    }
    if (options.surface_replay.empty()) return surfaces;
    surfaces.replay = read_file(options.surface_replay, std::size_t{64} << 20, "replay", read_replay);
    return surfaces;
}

std::string show_folder(const Options& options) {
    if (!options.show_folder.empty() || options.state_file.empty()) return options.show_folder;
    return (std::filesystem::path(options.state_file).parent_path() / "shows").string();
}

std::shared_ptr<const LeftScene> read_left(const Options& options, const LeftScene& kept,
                                           const std::shared_ptr<const Gels>& gels) {
    try {
        return read_whole_left(options, kept, gels);
    } catch (const std::exception& exception) {  // also where there is not enough memory
        spdlog::warn("state: '{}' and what was done before cannot be undone: {}", kept.label, exception.what());
        return nullptr;
    }
}

Scene first_scene(const Options& options, Revision* restored_rev, UndoRecord* undo) {
    std::optional<saved::Show> show;
    std::string state_sha256;
    if (!options.state_file.empty()) show = read_state_file(options.state_file, &state_sha256);
    if (show && restored_rev != nullptr) *restored_rev = show->scene_rev();
    const auto gels = gels_of(options);
    auto [scene, whole, same] = show ? saved_scene(options, *show, gels) : Restored{scene_of(asset_of(options))};
    scene.gels = gels;
    const bool restored = show.has_value();
    if (!restored || options.size_given) {
        v1::Command size;
        size.mutable_set_size()->set_width_px(static_cast<std::uint32_t>(std::max(options.width_px, 0)));
        size.mutable_set_size()->set_height_px(static_cast<std::uint32_t>(std::max(options.height_px, 0)));
        apply_option(scene, size);
        scene.size_auto = !restored && !options.size_given;
    }
    if (!restored || options.technique_given || options.samples) {
        v1::Command command;
        v1::SetTechnique& technique = *command.mutable_set_technique();
        if (!restored || options.technique_given) technique.set_technique(options.technique);
        if (options.samples) technique.set_samples(*options.samples);
        apply_option(scene, command);
    }
    if (const std::string& file = options.patch_file; !file.empty()) {
        v1::Command patch;
        *patch.mutable_set_patch() = read_file(file, kMaxPatchFileBytes, "patch", read_patch_toml);
        apply_file(scene, patch, file);
    }
    if (const std::string& file = options.surface_map; !file.empty()) {
        v1::Command map;
        *map.mutable_set_surfaces() = read_file(file, kMaxSurfaceFileBytes, "map", read_surfaces_toml);
        apply_file(scene, map, file);
    }
    if (!whole && options.serves()) keep_show_aside(options.state_file);  // a job saves nothing
    if (undo != nullptr && same) *undo = restored_undo(options, state_sha256, scene);
    scene.traced = std::make_shared<const trace::Geometry>(scene.asset);
    if (!same) {
        if (const std::string hint = trace::take_first_view(scene); !hint.empty())
            spdlog::warn("{}: {}", scene.asset->name, hint);
        scene.home = scene.camera;
    }
    if (!same && !scene.asset->exposure_ev100)
        scene.exposure_ev100 = trace::metered_ev100(scene).value_or(scene.exposure_ev100);
    if (options.serves()) scene.drawn = lighting::make_drawn(scene.traced, true);
    return std::move(scene);
}

std::function<Gpu::Made()> gpu_maker(const Options& options) {
    return [options] {
        Gpu::Made made;
        if (options.renderer == "null") {
            made.renderer = std::make_unique<NullRenderer>();
            return made;
        }
        made.context = gl::Context::create({options.device, options.gl_debug});
        auto renderer = std::make_unique<Renderer>(*made.context, direct_light_of(options));
        renderer->make_transport_beside();
        renderer->set_surfels({.bytes = options.transport_bytes});
        renderer->set_layer_bytes(options.layer_bytes);
        made.renderer = std::move(renderer);
        return made;
    };
}

int run_job(const Options& options, Scene scene) {
    if (!options.bake.scene.empty()) return run_bake(options, std::move(scene));
    if (options.renderer == "null") throw std::runtime_error("--oneshot needs --renderer gl");
    std::unique_ptr<gl::Context> context;
    std::unique_ptr<Renderer> renderer;
    sequence::RunOptions run;
    run.out = options.out;
    run.shard = *sequence::parse_shard(options.shard);
    run.json = options.json;
    run.isa = options.isa;
    run.isa_used = lighting::isa_in_use();
    run.version = GONIO_VERSION;
    run.settings = options.direct_light + " " + std::to_string(options.transport_bytes) + " " +
                   sha256_of_file(options.gel_file).sha256;
    run.renderer = [&]() -> Renderer& {
        if (renderer) return *renderer;
        context = gl::Context::create({options.device, options.gl_debug});
        spdlog::info("{}", context->description());
        renderer = std::make_unique<Renderer>(*context, direct_light_of(options));
        renderer->set_links(transport::kMostLinks);
        renderer->set_surfels({.bytes = options.transport_bytes});
        return *renderer;
    };
    run.gl = [&] { return context ? context->description() : ""; };
    return run_oneshot(std::move(scene), options.oneshot, {true, {}, "", options.load, options.max_memory}, run);
}

}  // namespace gonio
