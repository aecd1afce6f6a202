#include "server/lighting/posed_bodies.h"

#include <algorithm>

#include "server/lighting/packed_normal.h"

namespace gonio::lighting {

PosedBodies::PosedBodies(std::shared_ptr<const Bodies> bodies) : bodies_(std::move(bodies)) {
    const SceneAsset& shown = bodies_->shown;
    std::vector<glm::vec3> at_home;
    const auto positions = [&](std::size_t part) {
        const Instance& instance = shown.instances[part];
        at_home.clear();
        for (const Vertex& vertex : shown.meshes[static_cast<std::size_t>(instance.mesh)].vertices)
            at_home.emplace_back(instance.world_from_mesh * glm::dvec4(glm::dvec3(vertex.position), 1.0));
        return std::span<const glm::vec3>(at_home);
    };
    table_ = make_material_table(shown, positions);
    home_triangles_ = table_.triangles;
    home_ = make_clusters(shown, positions);
    clusters_ = home_;
    std::size_t cluster = 0;
    for (std::size_t part = 0; part < shown.instances.size(); ++part) {
        const std::uint32_t end =
            part + 1 < shown.instances.size() ? table_.first_triangle[part + 1] : ~std::uint32_t{0};
        Range& own = clusters_of_.emplace_back();
        own.first = cluster;
        const auto look_of = [&](const Cluster& one) { return home_.triangles[one.first_triangle].look; };
        while (cluster < home_.clusters.size() && look_of(home_.clusters[cluster]) < end) ++cluster;
        own.end = cluster;
        place(part, std::nullopt);
    }
}

void PosedBodies::place(std::size_t index, const std::optional<glm::dmat4>& local_from_home) {
    const glm::mat4 pose(local_from_home.value_or(glm::dmat4(1.0)));
    const glm::mat3 turn(pose);
    for (std::size_t c = clusters_of_[index].first; c < clusters_of_[index].end; ++c) {
        const Cluster& home = home_.clusters[c];
        Cluster& cluster = clusters_.clusters[c];
        cluster.triangles = local_from_home ? home.triangles : std::uint16_t{0};
        cluster.centre = glm::vec3(pose * glm::vec4(home.centre, 1.0f));
        cluster.axis = turn * home.axis;
        for (std::uint32_t v = home.first_vertex; v < home.first_vertex + home.vertices; ++v) {
            const glm::vec4 p = pose * glm::vec4(home_.x[v], home_.y[v], home_.z[v], 1.0f);
            clusters_.x[v] = p.x, clusters_.y[v] = p.y, clusters_.z[v] = p.z;
        }
        for (std::uint32_t t = home.first_triangle; t < home.first_triangle + home.triangles; ++t) {
            const std::uint32_t look = home_.triangles[t].look;
            for (std::size_t k = 0; k < 3; ++k)
                table_.triangles[look].normal[k] = pack_normal(turn * unpack_normal(home_triangles_[look].normal[k]));
        }
    }
}

std::size_t PosedBodies::part_of(std::uint32_t triangle) const {
    const auto above = std::ranges::upper_bound(table_.first_triangle, triangle);
    return static_cast<std::size_t>(above - table_.first_triangle.begin()) - 1;
}

}  // namespace gonio::lighting
