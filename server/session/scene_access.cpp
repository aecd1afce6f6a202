#include "server/session/scene_access.h"

#include <algorithm>
#include <filesystem>

#include "protocol/schema/upload_name.h"
#include "protocol/text/shortened_text.h"

namespace gonio {
namespace {

namespace fs = std::filesystem;

// Result: the file with every link followed, if it lies below the folder; else nothing.
std::string below(const fs::path& folder, const fs::path& file) {
    std::error_code failed;
    const fs::path root = fs::canonical(folder, failed);
    if (failed) return {};
    const fs::path real = fs::canonical(file, failed);
    if (failed || real == root) return {};
    const bool inside = std::mismatch(root.begin(), root.end(), real.begin(), real.end()).first == root.end();
    return inside ? real.string() : std::string();
}

}  // namespace

Result<std::string> scene_path(const SceneAccess& access, const std::string& file) {
    if (is_built_in(file)) return file;
    if (file.starts_with(kUploadPrefix)) {
        const std::string name = file.substr(kUploadPrefix.size());
        if (!is_upload_name(name) || access.upload_folder.empty())
            return Error{"invalid_argument", "load_scene.file", shortened_text(file, 80),
                         "is not the name of an upload"};
        const std::string path = below(access.upload_folder, fs::path(access.upload_folder) / name);
        if (path.empty()) return Error{"not_found", "load_scene.file", file, "there is no such upload"};
        return path;
    }
    if (access.roots.empty() && access.any_path) return file;
    for (const std::string& root : access.roots) {
        for (const fs::path& tried : {fs::path(root) / file, fs::path(file)}) {  // an absolute file replaces the root
            const std::string path = below(root, tried);
            if (!path.empty()) return path;
        }
    }
    return Error{"permission", "load_scene.file", shortened_text(file, 200),
                 access.roots.empty() ? "this server loads its built-in scenes and uploads only: it has no --scene-root"
                                      : "clients may load files below this server's --scene-root only"};
}

}  // namespace gonio
