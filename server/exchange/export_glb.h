// A scene as it stands, as binary glTF 2.0. Pure; any thread.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>

#include "ies/core/result.h"
#include "server/scene/asset.h"

namespace gonio {
struct Scene;
}  // namespace gonio

namespace gonio::exchange {

// Of a scene's file that is written: clients are sent no more at once, and take no more back as an upload.
inline constexpr std::size_t kMostSavedBytes = (std::size_t{256} << 20) - (std::size_t{1} << 16);

inline Error too_large_scene() {
    return {"too_large", "save_scene", std::to_string(kMostSavedBytes >> 20) + " MiB",
            "the scene would be a larger file"};
}

// Called between parts of the work with how many of them are done.
using Parts = std::function<void(std::size_t done, std::size_t all)>;

// Result: the bytes of a .glb that load_scene() reads back as what is seen now. It has geometry, materials, textures
// and vertex colours, the camera, then the kept views. Points, spots and suns are KHR_lights_punctual. Measured lights
// are EXT_lights_ies, with fallback_of() beside it on the same node, for programs that know no measured light. Level,
// master, white and gel are in multiplier and colour. The level is told apart in extras, for load_scene() alone.
// Errors: "too_large" (`where`: the light, or "save_scene"), "bad_image".
Result<std::string> export_glb(const Scene& scene, const Parts& each = {});

// Result: the same of instances alone, in this order. in_world: where they stand; else all in their meshes' own axes.
Result<std::string> export_geometry(const SceneAsset& asset, std::span<const std::size_t> instances, bool in_world);

}  // namespace gonio::exchange
