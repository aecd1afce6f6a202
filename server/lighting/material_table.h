// What the triangles of a scene look like, as SIMD kernels read it where rays or pixels meet them. Made once per scene;
// immutable, any thread.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "server/trace/geometry.h"

namespace gonio::lighting {

inline constexpr std::size_t kLevels =
    15;  // of a texture; images of 2^15 texels a side and more start at a coarser one

struct MaterialTable {
    std::vector<std::uint32_t> first_triangle;  // of an instance, into triangles; then as in its mesh
    struct Triangle {                           // 16 bytes
        std::uint32_t normal[3];                // shading normals, octahedral, 2 snorm16
        std::uint32_t material;                 // index into materials
    };
    std::vector<Triangle> triangles;
    struct TriangleUv {  // 28 bytes: where a triangle lies on its texture
        glm::vec2 uv[3];
        float uv_per_m;  // texture sides per metre of surface
    };
    std::vector<TriangleUv> uv;  // like triangles; empty if the scene has no images
    struct VertexColors {        // 24 bytes: of a triangle's corners, Mesh::colors
        glm::u16vec4 corner[3];
    };
    std::vector<VertexColors> colors;  // like triangles; empty if the scene has none
    struct Tangents {  // 16 bytes: of a triangle's corners, octahedral, and Mesh::tangents' w; 0: it has none
        std::uint32_t tangent[3];
        float side;
    };
    std::vector<Tangents> tangents;  // like triangles; empty if the scene has no normal maps
    struct NormalMap {               // 8 bytes: of a material
        std::int32_t image;          // index into textures, -1: none
        float scale;
    };
    std::vector<NormalMap> normal_maps;  // by SceneAsset::materials; likewise
    struct Paint {                       // 32 bytes: a material
        glm::vec3 albedo;
        std::int32_t image;  // index into textures, -1: none
        glm::vec3 emission_nit;
        std::int32_t emission_image;
    };
    std::vector<Paint> materials;  // by SceneAsset::materials
    // Likewise: 1 where a back is shown and does not emit; empty if there is no such emitter.
    std::vector<std::int32_t> dark_backs;
    struct Texture {  // 128 bytes: an image as a material repeats it
        std::int32_t width_px, height_px;
        std::int32_t wrap_s, wrap_t;        // Wrap
        std::int32_t last_level;            // levels of half the size each, down to 1 × 1
        std::int32_t first_texel[kLevels];  // of a level, into texels
        std::int32_t unused[12];
    };
    std::vector<Texture> textures;
    std::vector<std::uint32_t> texels;  // square roots of linear rgb: 11, 11 and 10 bits from the lowest on
    const SceneAsset* asset = nullptr;  // the geometry's, which outlives this
};

// Result: of the vertices of an instance's mesh, local, m.
using PositionsOf = std::function<std::span<const glm::vec3>(std::size_t instance)>;
MaterialTable make_material_table(const SceneAsset& asset, const PositionsOf& positions);
MaterialTable make_material_table(const trace::Geometry& geometry);

}  // namespace gonio::lighting
