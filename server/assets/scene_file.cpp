#include "server/assets/assets.h"
#include "server/assets/gltf.h"

namespace gonio {

Result<std::shared_ptr<const SceneAsset>> load_scene(const std::string& name, const std::string& shown,
                                                     double max_albedo, std::size_t most_bytes) {
    if (name == "cornell") return make_cornell();
    if (name == "atrium") return make_atrium();
    if (shown.empty() || shown == name) return load_gltf(name, name, max_albedo, most_bytes);
    auto scene = load_gltf(name, shown, max_albedo, most_bytes);
    if (scene || scene.error().where != name) return scene;
    Error error = scene.error();
    error.where = shown;
    return error;
}

}  // namespace gonio
