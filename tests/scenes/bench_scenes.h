// Scenes to measure with, beside the built-in ones. Deterministic; metres, +Y up.
#pragma once

#include <memory>

#include "server/scene/asset.h"

namespace gonio::test {

// Two rooms of a corridor, 8 × 3.2 × 3 m, with a partition between them: light reaches the far one only through a
// doorway. One luminaire, in the near room. Seen in section from outside: front wall and ceiling show their backs only.
std::shared_ptr<const SceneAsset> make_corridor();

// A stage of 12 × 8 m: floor, back wall, wings, set pieces; side × side luminaires in a grid above (side 1 to 8), their
// flux 8 times one profile's in all, however many they are. Open towards the house and upwards.
std::shared_ptr<const SceneAsset> make_stage(int side);

}  // namespace gonio::test
