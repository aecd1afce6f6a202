// Structs and limits that C++ and GLSL share. Members are vec4, or all of 4 bytes and in storage buffers only, so that
// std140, std430 and C++ agree. The GL test layout_test compares them with the program's own introspection.
#ifdef __cplusplus
#pragma once
#include <cstdint>
#include <glm/glm.hpp>
namespace gonio::layouts {
using vec4 = glm::vec4;
using uint = std::uint32_t;
#define GONIO_FUNCTION constexpr
#else
#define GONIO_FUNCTION
#endif

// One luminaire in the composite: rgb = lux per unit of its irradiance layer (peak cd × multiplier × level × colour).
struct LightWeight {
    vec4 rgb;
};

// The scale of a false-colour view (server/scene/false_color.h). Colours are R'G'B' in 0..1.
#define GONIO_FALSE_COLORS 256
#define GONIO_MAX_LEVELS 32
struct FalseColorBlock {
    vec4 colors[GONIO_FALSE_COLORS];
    vec4 under;
    vec4 over;
    vec4 below_mark;
    vec4 range;                         // low, high, 1: logarithmic, steps or 0
    vec4 marks;                         // what is less is marked, how many levels there are; 0: none
    vec4 levels[GONIO_MAX_LEVELS / 4];  // of isolux lines, ascending
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

// Vertex (server/scene/scene.h) as words.
struct MeshVertex {
    float x, y, z;
    float normal_x, normal_y, normal_z;
    float u, v;
};

struct SurfelDisc {
    vec4 position;  // local, m
    vec4 normal;    // unit
};

// A triangle of CellMap::Table.
struct CellTriangle {
    uint first;  // cell: the front's, then the back's
    uint side;   // cells along each edge
};

// An entry of transport::Table: half floats, the red in the lower half.
struct HalfIrradiance {
    uint red_green;
    uint blue;
};

// A pixel that shows more than one surface, and one that its samples take their light of (server/lighting/antialias.h).
struct EdgePixel {
    uint x;
    uint first_tap;
    uint count;         // of taps
    float own;          // share of the samples that show what the centre does
    vec4 emission_nit;  // of the others, × their share
};
struct EdgeTap {
    vec4 albedo_share;  // reflectance of its samples × their share; their share
    uint x;             // pixel; GONIO_NO_PIXEL: they show the background
    uint y;
    uint pad0;
    uint pad1;
};

// A photometric web's buffer begins with this. Then come floats: v angles, h angles, first-cell tables of v and of h,
// and intensity / peak, h-major. The functions: where the others begin, from the first v angle.
struct WebHeader {
    uint goniometer;  // 0 C, 1 B, 2 A
    uint n_v;
    uint n_h;
    uint table;  // entries of each first-cell table
};
GONIO_FUNCTION uint web_h(WebHeader web) {
    return web.n_v;
}
GONIO_FUNCTION uint web_v_cells(WebHeader web) {
    return web.n_v + web.n_h;
}
GONIO_FUNCTION uint web_h_cells(WebHeader web) {
    return web_v_cells(web) + web.table;
}
GONIO_FUNCTION uint web_ratios(WebHeader web) {
    return web_h_cells(web) + web.table;
}

#define GONIO_AROUND 16u  // surfels around a surfel
#define GONIO_MAX_LAYERS 64
#define GONIO_NO_SURFEL 65535u
#define GONIO_BODY 0x80000000u  // of what a pixel shows: a part of a luminaire's body
#define GONIO_NO_PIXEL 65535u
#define GONIO_MAX_SEED_DIRECTIONS 4096

#ifdef __cplusplus
static_assert(sizeof(LightWeight) == 16 && sizeof(DrawInstance) == 64 && sizeof(WebHeader) == 16);
inline const WebHeader& web_header(const uint* words) {
    return *reinterpret_cast<const WebHeader*>(words);
}
inline const float* web_values(const uint* words) {
    return reinterpret_cast<const float*>(words) + sizeof(WebHeader) / sizeof(uint);
}
}  // namespace gonio::layouts
#endif
