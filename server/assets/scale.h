// The size of a scene: a file in other units than metres is mended by a factor, and a size that no room has is said.
#pragma once

#include "server/scene/asset.h"

namespace gonio {

// A scene whose longest side lies outside of this is no room, nor a hall.
inline constexpr double kLeastExtent_m = 0.1, kMostExtent_m = 200.0;

// Scales geometry, cameras and positions of lights about the world's origin. factor: of load_scene. Candela, the
// luminance of emissive surfaces and the luminaires' own openings stay: illuminance goes with 1/factor².
void scale_scene(SceneAsset& scene, double factor);

// Puts a warning before the others where the scene's longest side is no room's: the side in metres, and the scale
// that the file's unit is likely to ask for. `scale` in it is that of load_scene.
void warn_of_extent(SceneAsset& scene);

}  // namespace gonio
