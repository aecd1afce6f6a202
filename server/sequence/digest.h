// SHA-256 of the scene that a sequence depends on.
#pragma once

#include <string>

#include "server/scene/asset.h"

namespace gonio::sequence {

// Result: of a scene's geometry, materials, images, lights and bodies of luminaires, wherever its file is.
std::string sha256_of_asset(const SceneAsset& asset);

}  // namespace gonio::sequence
