#include "server/lighting/clusters.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <span>
#include <utility>

#include "server/lighting/kernels.h"
#include "server/lighting/posed_bodies.h"

namespace gonio::lighting {
namespace {

// Result: a triangle's vertices in the same order of going round, from the least on.
std::array<unsigned, 3> turned(unsigned a, unsigned b, unsigned c) {
    if (a <= b && a <= c) return {a, b, c};
    return b <= c ? std::array{b, c, a} : std::array{c, a, b};
}

// A mesh cut into clusters, in its own vertices.
struct Cut {
    std::vector<meshopt_Meshlet> meshlets;
    std::vector<unsigned> vertices;
    std::vector<unsigned char> corners;
    std::vector<std::uint32_t> triangles;  // of the mesh, in the order of corners
};

Cut cut(const Mesh& mesh) {
    Cut result;
    constexpr float kConeWeight = 0.5f;
    const std::size_t most = meshopt_buildMeshletsBound(mesh.indices.size(), kClusterVertices, kClusterTriangles);
    result.meshlets.resize(most);
    result.vertices.resize(most * kClusterVertices);
    result.corners.resize(most * kClusterTriangles * 3);
    result.meshlets.resize(meshopt_buildMeshlets(result.meshlets.data(), result.vertices.data(), result.corners.data(),
                                                 mesh.indices.data(), mesh.indices.size(),
                                                 &mesh.vertices.data()->position.x, mesh.vertices.size(),
                                                 sizeof(Vertex), kClusterVertices, kClusterTriangles, kConeWeight));
    // The library keeps vertices, not the triangles' indices.
    using Known = std::pair<std::array<unsigned, 3>, std::uint32_t>;
    std::vector<Known> known;
    for (std::size_t t = 0; t < mesh.indices.size() / 3; ++t) {
        const std::uint32_t* v = &mesh.indices[3 * t];
        known.emplace_back(turned(v[0], v[1], v[2]), static_cast<std::uint32_t>(t));
    }
    std::sort(known.begin(), known.end());
    for (const meshopt_Meshlet& piece : result.meshlets) {
        const unsigned* v = &result.vertices[piece.vertex_offset];
        for (unsigned t = 0; t < piece.triangle_count; ++t) {
            const unsigned char* c = &result.corners[piece.triangle_offset + 3 * t];
            result.triangles.push_back(
                std::lower_bound(known.begin(), known.end(), Known{turned(v[c[0]], v[c[1]], v[c[2]]), 0u})->second);
        }
    }
    return result;
}

// positions: of the mesh's vertices, local.
void add_instance(Clusters& result, std::span<const glm::vec3> positions, const Material& material, const Cut& pieces,
                  std::uint32_t first_look) {
    std::size_t triangle = 0;
    for (const meshopt_Meshlet& piece : pieces.meshlets) {
        const unsigned* vertices = &pieces.vertices[piece.vertex_offset];
        const unsigned char* corners = &pieces.corners[piece.triangle_offset];
        const meshopt_Bounds bounds = meshopt_computeMeshletBounds(
            vertices, corners, piece.triangle_count, &positions.data()->x, positions.size(), sizeof(glm::vec3));
        Cluster cluster;
        cluster.first_vertex = static_cast<std::uint32_t>(result.x.size());
        cluster.first_triangle = static_cast<std::uint32_t>(result.triangles.size());
        cluster.vertices = static_cast<std::uint16_t>(piece.vertex_count);
        cluster.triangles = static_cast<std::uint16_t>(piece.triangle_count);
        cluster.one_sided = material.culled_back();
        cluster.alpha_mask = material.alpha_mask || material.transmissive();
        cluster.centre = {bounds.center[0], bounds.center[1], bounds.center[2]};
        cluster.radius = bounds.radius;
        if (bounds.cone_cutoff < 1.0f) {  // else the normals have no cone
            cluster.axis = {bounds.cone_axis[0], bounds.cone_axis[1], bounds.cone_axis[2]};
            cluster.cone_cutoff = bounds.cone_cutoff;
        }
        for (unsigned i = 0; i < piece.vertex_count; ++i) {
            const glm::vec3& p = positions[vertices[i]];
            result.x.push_back(p.x), result.y.push_back(p.y), result.z.push_back(p.z);
        }
        for (std::vector<float>* array : {&result.x, &result.y, &result.z})
            array->resize((array->size() + kSimdWidth - 1) / kSimdWidth * kSimdWidth, 0.0f);
        for (unsigned t = 0; t < piece.triangle_count; ++t) {
            const unsigned char* c = corners + 3 * t;
            result.triangles.push_back({{c[0], c[1], c[2]}, first_look + pieces.triangles[triangle++]});
        }
        result.clusters.push_back(cluster);
    }
}

}  // namespace

Clusters make_clusters(const SceneAsset& asset, const PositionsOf& positions) {
    Clusters result;
    if (asset.triangles() > kMostTriangles) return result;
    std::vector<Cut> cuts;
    for (const Mesh& mesh : asset.meshes) cuts.push_back(mesh.indices.empty() ? Cut{} : cut(mesh));
    std::uint32_t first_look = 0;
    for (std::size_t i = 0; i < asset.instances.size(); ++i) {
        const auto mesh = static_cast<std::size_t>(asset.instances[i].mesh);
        const auto material = static_cast<std::size_t>(asset.meshes[mesh].material);
        add_instance(result, positions(i), asset.materials[material], cuts[mesh], first_look);
        first_look += static_cast<std::uint32_t>(asset.meshes[mesh].indices.size() / 3);
    }
    return result;
}

Clusters make_clusters(const trace::Geometry& geometry) {
    return make_clusters(geometry.asset(),
                         [&](std::size_t instance) { return geometry.positions(static_cast<int>(instance)); });
}

std::shared_ptr<const Drawn> make_drawn(const std::shared_ptr<const trace::Geometry>& geometry, bool clustered) {
    const std::shared_ptr<const Bodies>& bodies = geometry->asset().bodies;
    return std::make_shared<const Drawn>(Drawn{geometry, make_material_table(*geometry), clustered,
                                               clustered ? make_clusters(*geometry) : Clusters(),
                                               bodies ? std::make_shared<const PosedBodies>(bodies) : nullptr});
}

}  // namespace gonio::lighting
