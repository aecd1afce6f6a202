// A scene whose positions are told relative to another place (SceneAsset::place).
#pragma once

#include "server/scene/scene.h"

namespace gonio {

// Result: the scene with all positions that somebody has set moved by so much, in m: lights, camera, saved views,
// presets, cues, grids and observers. Those that would come to lie beyond kFarthestSet_m stay there, since the show
// could not be opened again. What they are shared with is not changed. Pure.
inline constexpr double kFarthestSet_m = 1e6;  // that commands may set
Scene moved_by(const Scene& scene, const glm::dvec3& by_m);

}  // namespace gonio
