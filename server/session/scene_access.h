// Which files on this machine a client may load as a scene, and how. Reads the file system; any thread.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "ies/core/result.h"
#include "server/assets/assets.h"
#include "server/scene/gel.h"

namespace gonio {

struct SceneAccess {
    bool any_path = true;  // where there are no roots: any file; else none but uploads
    std::vector<std::string>
        roots;                   // folders: files below them, links followed; relative names are sought in them first
    std::string upload_folder;   // of "upload:NAME"; empty: there are no uploads
    LoadOptions load;            // of load_scene
    std::size_t max_memory = 0;  // of the process, bytes, as of memory_room; 0: no bound of its own
    std::string show_folder{};   // of open_show and save_show; empty: there are none
    std::shared_ptr<const Gels> gels{};  // Scene::gels, of a show that is opened
};

// file: as of load_scene. Result: what to open: the name of a built-in scene as it is, else a path.
// Errors: "permission" for files that clients may not load, whether they exist or not; "not_found", "invalid_argument"
// (an upload's name).
Result<std::string> scene_path(const SceneAccess& access, const std::string& file);

}  // namespace gonio
