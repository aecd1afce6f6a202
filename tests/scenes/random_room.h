// Rooms that nobody tuned anything for: each follows from one number.
#pragma once

#include <cstdint>

namespace gonio {
struct Scene;
}  // namespace gonio

namespace gonio::test {

// Returns a closed room of 2 to 12 m with reflectances up to 0.95 and 1 to 16 luminaires. Up to seven things stand in
// it that light gets into by detours: cupboards open by a slit, shelves, boxes in boxes, and walls with a keyhole or a
// doorway. There are thin double-sided sheets, panes, lampshades and housings around luminaires too. Some luminaires
// are narrow beams or have luminous openings, and one room in eight is hazy. The camera is inside. Equal seeds give
// equal rooms.
Scene random_room(std::uint64_t seed);

}  // namespace gonio::test
