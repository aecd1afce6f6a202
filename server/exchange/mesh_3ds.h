// 3DS models -> triangles. Chunks of Autodesk's 3D Studio 3 that hold meshes and diffuse colours are read; keyframes,
// cameras, lights and textures are not. Pure; any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "ies/core/result.h"

namespace gonio::exchange {

inline constexpr std::size_t kMax3dsBytes = std::size_t{256} << 20;    // "too_large"
inline constexpr std::size_t kMax3dsVertices = std::size_t{4} << 20;   // over all meshes: likewise
inline constexpr std::size_t kMax3dsTriangles = std::size_t{8} << 20;  // likewise
inline constexpr std::size_t kMax3dsMaterials = 4096;                  // likewise

struct Mesh3ds {
    struct Material {
        std::string name;
        glm::vec3 color{0.5f};  // diffuse, linear Rec.709, 0..1
    };
    // One material's triangles, each with three vertices of its own.
    struct Part {
        int material = -1;                 // index into materials; -1: none
        std::vector<glm::vec3> positions;  // 3 a triangle, counter-clockwise from the front
    };
    // Faces that became no triangle, each counted once.
    struct LeftOut {
        std::size_t no_point = 0;    // a point that its object does not have
        std::size_t not_finite = 0;  // a coordinate that is not finite, or beyond 1e9
        std::size_t no_area = 0;     // points in line
    };
    std::vector<Material> materials;
    std::vector<Part> parts;
    LeftOut left_out;
    std::size_t bytes_behind = 0;      // of the file, behind its main chunk: they are not read
    glm::dvec3 least{0.0}, most{0.0};  // of all positions
    std::size_t faces() const { return triangles() + left_out.no_point + left_out.not_finite + left_out.no_area; }
    std::size_t triangles() const {
        std::size_t count = 0;
        for (const Part& part : parts) count += part.positions.size() / 3;
        return count;
    }
};

// Result: in the file's units and axes (1 unit is 1 mm in MVR and GDTF, Z up). Positions are as written: a mesh's own
// matrix says where its axes were, and is not applied. Faces of no area, or with points that do not exist or are not
// finite, are left out and counted. A file without faces is none the less read. Errors: "bad_3ds" (no 3DS file; a chunk
// is longer than what it lies in), "too_large".
Result<Mesh3ds> read_3ds(std::string_view bytes);

// GDTF scales a mesh along each axis to its model's Length (X), Width (Y) and Height (Z), in metres, whatever its own
// size. Result: the factors for a mesh that reaches from least to most. Along an axis where either has no extent the
// factor is `unit_m`, the metres of a unit.
glm::dvec3 model_scale(const glm::dvec3& least, const glm::dvec3& most, const glm::dvec3& size_m, double unit_m);

}  // namespace gonio::exchange
