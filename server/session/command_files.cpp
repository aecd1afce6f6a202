#include "server/session/command_files.h"

#include "protocol/text/shortened_text.h"
#include "server/assets/assets.h"
#include "server/base/memory_room.h"
#include "server/lighting/clusters.h"
#include "server/scene/light_tables.h"
#include "server/trace/exposure.h"
#include "server/trace/geometry.h"

namespace gonio {

static const v1::Profile* profile_of(const v1::Command& command) {
    if (command.has_set_light() && command.set_light().has_profile()) return &command.set_light().profile();
    if (command.has_add_light() && command.add_light().light().has_profile())
        return &command.add_light().light().profile();
    return nullptr;
}

bool needs_files(const v1::Command& command) {
    return command.has_load_scene() || profile_of(command) != nullptr;
}

Result<Loaded> read_files(const v1::Command& command, const SceneAccess& access) {
    Loaded loaded;
    if (command.has_load_scene()) {
        const std::string& file = command.load_scene().file();
        const double scale = command.load_scene().has_scale() ? command.load_scene().scale() : 1.0;
        const auto path = scene_path(access, file);
        if (!path) return path.error();
        LoadOptions load = access.load;
        load.scale = scale;
        auto asset = load_scene(*path, file, load, memory_room(access.max_memory));
        if (!asset) return asset.error();
        loaded.asset = *asset;
        loaded.traced = std::make_shared<const trace::Geometry>(loaded.asset);
        loaded.drawn = lighting::make_drawn(loaded.traced, true);
        if (!loaded.asset->exposure_ev100) {
            Scene scene = scene_of(loaded.asset);
            scene.traced = loaded.traced;
            loaded.exposure_ev100 = trace::metered_ev100(scene);
        }
    }
    if (const v1::Profile* profile = profile_of(command)) {
        const std::string& bytes = profile->photometry();
        if (bytes.size() > kMaxProfileBytes) {
            return Error{"too_large", "profile.photometry", std::to_string(bytes.size()) + " bytes",
                         "a profile may have at most 1 MiB"};
        }
        auto read = !profile->has_photometry() ? builtin_profile(profile->name())
                                               : make_profile(shortened_text(profile->name(), kMaxNameBytes), bytes);
        if (!read) return read.error();
        loaded.profile = *read;
        tables_of(*loaded.profile);
    }
    return loaded;
}

}  // namespace gonio
