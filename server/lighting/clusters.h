// The triangles of a scene as the CPU rasterises them: clusters of neighbours that are culled together. Made once per
// scene; immutable, any thread.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "server/lighting/material_table.h"

namespace gonio::lighting {

// Beyond this many triangles, counted per instance, the CPU keeps no clusters and GL draws the G-buffer: some 100 bytes
// each, with the setups of a picture.
inline constexpr std::size_t kMostTriangles = std::size_t{1} << 22;
inline constexpr std::size_t kClusterVertices = 64, kClusterTriangles = 124;  // meshlets' usual size

struct Cluster {
    std::uint32_t first_vertex = 0;    // into Clusters::x, y, z: a multiple of kSimdWidth
    std::uint32_t first_triangle = 0;  // into Clusters::triangles
    std::uint16_t vertices = 0, triangles = 0;
    bool one_sided = true;     // its backs are not seen
    bool alpha_mask = false;   // its texture has holes, or it is transmissive
    glm::vec3 centre{0.0f};    // of a sphere around it, local, m
    float radius = 0.0f;       // m
    glm::vec3 axis{0.0f};      // of a cone around its normals
    float cone_cutoff = 2.0f;  // all face away where dot(centre − eye, axis) ≥ cutoff · |centre − eye| + radius
};

struct Clusters {
    std::vector<Cluster> clusters;
    std::vector<float> x, y, z;  // vertices, local, m
    struct Triangle {
        std::array<std::uint8_t, 3> corner;  // counted from its cluster's first vertex
        std::uint32_t look;                  // index into MaterialTable::triangles
    };
    std::vector<Triangle> triangles;
    bool empty() const { return clusters.empty(); }
};

// Result: none if the scene has more than kMostTriangles.
Clusters make_clusters(const SceneAsset& asset, const PositionsOf& positions);
Clusters make_clusters(const trace::Geometry& geometry);

class PosedBodies;
// What the CPU's passes read of a scene.
struct Drawn {
    std::shared_ptr<const trace::Geometry> geometry;
    MaterialTable material_table;
    bool clustered;  // else no clusters were asked for
    Clusters clusters;
    std::shared_ptr<const PosedBodies> bodies;  // that are nowhere yet; null: there are none
};
// In a second for a million triangles. Any thread.
std::shared_ptr<const Drawn> make_drawn(const std::shared_ptr<const trace::Geometry>& geometry, bool clustered);

}  // namespace gonio::lighting
