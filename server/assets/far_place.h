// Scenes in survey coordinates, which lie thousands of kilometres from the origin.
#pragma once

#include "server/scene/asset.h"
#include "server/scene/farthest.h"

namespace gonio {

// Single precision has steps at a vertex. Coarser ones than this are said.
inline constexpr double kCoarsest_m = 0.01;

// Shifts a scene that reaches beyond kFarthest_m by whole kilometres, so that its middle lies within 1 km of the
// origin: surfaces, bodies, lights and cameras, in double precision. SceneAsset::place and the first warning say by how
// much. Clients still see and enter the file's positions: server/session/file_place.h.
void bring_near(SceneAsset& scene);

// Adds a warning where vertices lie so far from their mesh's origin that the file's single precision moves walls.
void warn_of_coarse_vertices(SceneAsset& scene);

}  // namespace gonio
