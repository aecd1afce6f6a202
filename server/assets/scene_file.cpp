#include "server/assets/assets.h"
#include "server/assets/gltf.h"

namespace gonio {

Result<std::shared_ptr<const SceneAsset>> load_scene(const std::string& name) {
    if (name == "cornell") return make_cornell();
    if (name == "atrium") return make_atrium();
    return load_gltf(name);
}

}  // namespace gonio
