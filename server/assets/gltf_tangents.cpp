// Tangents of meshes whose material has a normal map: of the file, or derived from the texture coordinates as
// MikkTSpace does it, by corner angles, with a vertex of its own for each side of a seam where the texture turns over.
#include <algorithm>
#include <cmath>

#include "server/assets/gltf_import.h"

namespace gonio {
namespace {

constexpr std::uint32_t kNone = ~0u;

// A vertex perpendicular: for where the texture has no direction.
glm::vec3 any_tangent(const glm::vec3& normal) {
    return glm::normalize(
        glm::cross(std::abs(normal.y) < 0.9f ? glm::vec3(0.0f, 1.0f, 0.0f) : glm::vec3(1.0f, 0.0f, 0.0f), normal));
}

// The vertices of triangles that turn the texture over, apart from those of the others. side: by vertex, 0 at first.
struct Sides {
    Mesh& mesh;
    std::vector<signed char> side;
    std::vector<std::uint32_t> twin;

    explicit Sides(Mesh& of) : mesh(of), side(of.vertices.size(), 0), twin(of.vertices.size(), kNone) {}
    // Result: the vertex, or its twin, that belongs to this side.
    std::uint32_t vertex_of(std::uint32_t vertex, signed char wanted) {
        if (side[vertex] == 0) side[vertex] = wanted;
        if (side[vertex] == wanted) return vertex;
        if (twin[vertex] == kNone) {
            const auto copy = static_cast<std::uint32_t>(mesh.vertices.size());
            mesh.vertices.push_back(mesh.vertices[vertex]);
            if (!mesh.colors.empty()) mesh.colors.push_back(mesh.colors[vertex]);
            if (!mesh.second_uv.empty()) mesh.second_uv.push_back(mesh.second_uv[vertex]);
            side.push_back(wanted);
            twin.push_back(kNone);
            twin[vertex] = copy;
        }
        return twin[vertex];
    }
};

}  // namespace

void derive_tangents(Mesh& mesh) {
    Sides sides(mesh);
    std::vector<glm::dvec3> sum(mesh.vertices.size(), glm::dvec3(0.0));
    for (std::size_t t = 0; t + 2 < mesh.indices.size(); t += 3) {
        glm::dvec3 p[3];
        glm::dvec2 uv[3];
        for (std::size_t k = 0; k < 3; ++k) {
            const Vertex& vertex = mesh.vertices[mesh.indices[t + k]];
            p[k] = glm::dvec3(vertex.position), uv[k] = glm::dvec2(vertex.uv);
        }
        const glm::dvec2 a = uv[1] - uv[0], b = uv[2] - uv[0];
        const double area = a.x * b.y - a.y * b.x;
        const glm::dvec3 along_u = ((p[1] - p[0]) * b.y - (p[2] - p[0]) * a.y) * (area > 0.0 ? 1.0 : -1.0);
        const double length = glm::length(along_u);
        if (area == 0.0 || !(length > 0.0) || !std::isfinite(length)) continue;
        // v points down: where it turns clockwise as seen from the front the texture is not turned over.
        const signed char side = area < 0.0 ? 1 : -1;
        for (std::size_t k = 0; k < 3; ++k) {
            std::uint32_t& index = mesh.indices[t + k];
            index = sides.vertex_of(index, side);
            sum.resize(mesh.vertices.size(), glm::dvec3(0.0));
            const glm::dvec3 to_next = p[(k + 1) % 3] - p[k], to_last = p[(k + 2) % 3] - p[k];
            const double cosine =
                glm::dot(to_next, to_last) / std::max(glm::length(to_next) * glm::length(to_last), 1e-300);
            sum[index] += along_u * (std::acos(std::clamp(cosine, -1.0, 1.0)) / length);
        }
    }
    mesh.tangents.clear();
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        const glm::dvec3 normal(mesh.vertices[i].normal), flat = sum[i] - normal * glm::dot(normal, sum[i]);
        const glm::vec3 tangent =
            glm::length(flat) > 1e-9 ? glm::vec3(glm::normalize(flat)) : any_tangent(mesh.vertices[i].normal);
        mesh.tangents.emplace_back(tangent, sides.side[i] < 0 ? -1.0f : 1.0f);
    }
}

}  // namespace gonio
