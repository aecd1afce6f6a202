// Structs and limits that C++ and GLSL share. Members are vec4 or uint only, so that std140, std430 and C++ agree; the
// GL test layout_test compares every member with the program's own introspection.
#ifdef __cplusplus
#pragma once
#include <cstdint>
#include <glm/glm.hpp>
namespace gonio::layouts {
using vec4 = glm::vec4;
using uint = std::uint32_t;
#endif

// One luminaire in the composite: rgb = lux per unit of its irradiance layer (peak cd × multiplier × level × colour).
struct LightWeight {
    vec4 rgb;
};

// One mesh drawn once: into the camera's view, or into one face of a cube map.
struct DrawInstance {
    vec4 row0;  // rows of the 3×4 matrix: mesh space -> world axes, rebased to the camera or the light, m
    vec4 row1;
    vec4 row2;
    uint face;            // cube face 0..5 = +X -X +Y -Y +Z -Z; 0 for the camera
    uint first_triangle;  // of the instance among all
    uint pad0;
    uint pad1;
};

#define GONIO_MAX_LAYERS 64
#define GONIO_NO_SURFEL 65535u
#define GONIO_MAX_SEED_DIRECTIONS 4096

#ifdef __cplusplus
static_assert(sizeof(LightWeight) == 16 && sizeof(DrawInstance) == 64);
}  // namespace gonio::layouts
#endif
