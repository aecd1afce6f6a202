// A scene as binary glTF, so that another renderer can be given exactly what this one has.
#pragma once

#include <memory>
#include <string>

#include "ies/core/result.h"
#include "server/scene/asset.h"

namespace gonio::test {

// Result: the bytes of a .glb that load_scene reads back as the same triangles, materials, instances, cameras (along
// the same line of sight) and luminaires (EXT_lights_ies, the web as LM-63 text in a buffer view). Errors:
// "unsupported" for an asset with images.
Result<std::string> write_glb(const SceneAsset& asset);

}  // namespace gonio::test
