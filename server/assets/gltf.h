// glTF 2.0 files (.gltf, .glb) -> SceneAsset. No GL; the readers behind it stay in the .cpp files.
#pragma once

#include <memory>
#include <string>

#include "ies/core/result.h"
#include "server/scene/scene.h"

namespace gonio {

// name: of the result. Result, errors, max_albedo and most_bytes as of load_scene. Opens nothing outside the file's own
// directory.
Result<std::shared_ptr<const SceneAsset>> load_gltf(const std::string& path, const std::string& name, double max_albedo,
                                                    std::size_t most_bytes);

}  // namespace gonio
