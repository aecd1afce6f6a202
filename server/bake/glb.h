// A scene with its map, as binary glTF: for engines and for Blender. No files.
#pragma once

#include <span>
#include <string>

#include "server/bake/bake.h"

namespace gonio::bake {

inline constexpr std::size_t kMostGlbBytes = std::size_t{1} << 30;

// irradiance: the sum's picture, lx rgb. Result: the bytes of a .glb with the same nodes, materials and textures, and
// the atlas as TEXCOORD_1. Luminance ρE/π is its emissive texture, 8 bits in sRGB; the strength in cd/m² is such that
// at most 0.1 % of texels are brighter. It has no lights: they are in the map. Backs of double-sided surfaces are
// triangles of their own. Errors: "too_large", "bad_image".
Result<std::string> lit_glb(const SceneAsset& asset, const Layout& layout, std::span<const float> irradiance);

}  // namespace gonio::bake
