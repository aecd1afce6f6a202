// A scene whose positions are told relative to another place (SceneAsset::place).
#pragma once

#include <glm/glm.hpp>
#include <optional>

namespace gonio {

struct Scene;

// Result: the scene with all positions that somebody has set moved by so much, in m: lights, camera, saved views,
// presets, cues, grids and observers. Nothing where one of them would come to lie beyond what commands may set. What
// they are shared with is not changed. Pure.
std::optional<Scene> moved_by(const Scene& scene, const glm::dvec3& by_m);

}  // namespace gonio
