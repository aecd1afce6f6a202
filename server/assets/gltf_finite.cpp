#include "server/assets/gltf_finite.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace gonio {
namespace {

bool is_number(const glm::vec3& value) {
    return std::isfinite(value.x) && std::isfinite(value.y) && std::isfinite(value.z);
}

bool has_image(const Material& material) {
    return std::max({material.base_color_image, material.emissive_image, material.normal_image,
                     material.transmission_image}) >= 0;
}

}  // namespace

std::vector<bool> vertices_used(const Mesh& mesh) {
    std::vector<bool> used(mesh.vertices.size());
    for (const std::uint32_t index : mesh.indices) used[index] = true;
    return used;
}

bool mend_values(std::vector<float>& values, std::size_t components, const Mesh& mesh, float instead) {
    if (std::all_of(values.begin(), values.end(), [](float value) { return std::isfinite(value); })) return false;
    const std::vector<bool> used = vertices_used(mesh);
    bool matters = false;
    for (std::size_t i = 0; i < values.size(); ++i) {
        if (std::isfinite(values[i])) continue;
        values[i] = instead;
        matters = matters || used[i / components];
    }
    return matters;
}

void mend_vertices(GltfImport& import, Mesh& mesh, const std::string& where) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
        const auto corner = [&](std::size_t k) { return mesh.vertices[mesh.indices[i + k]].position; };
        if (!is_number(corner(0)) || !is_number(corner(1)) || !is_number(corner(2))) continue;
        for (std::size_t k = 0; k < 3; ++k) mesh.indices[kept++] = mesh.indices[i + k];
    }
    if (const std::size_t lost = (mesh.indices.size() - kept) / 3; lost > 0)
        import.warn(std::to_string(lost) + (lost == 1 ? " triangle" : " triangles") +
                    " whose positions are no numbers left out; changes lux (" + where + ")");
    mesh.indices.resize(kept);
    std::vector<bool> odd_uv;
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        Vertex& vertex = mesh.vertices[i];
        if (!is_number(vertex.position)) vertex.position = glm::vec3(0.0f);  // no triangle has it
        if (std::isfinite(vertex.uv.x) && std::isfinite(vertex.uv.y)) continue;
        odd_uv.resize(mesh.vertices.size());
        odd_uv[i] = true;
        vertex.uv = glm::vec2(0.0f);
    }
    if (odd_uv.empty()) return;
    if (std::any_of(mesh.indices.begin(), mesh.indices.end(), [&](std::uint32_t index) { return odd_uv[index]; }))
        import.warn(std::string("texture coordinates that are no numbers are 0") +
                    (has_image(import.scene.materials[mesh.material]) ? "; changes lux" : "") + " (" + where + ")");
}

bool mend_normals(Mesh& mesh) {
    bool any = false;
    for (Vertex& vertex : mesh.vertices) {
        if (is_number(vertex.normal)) continue;
        vertex.normal = glm::vec3(0.0f);
        any = true;
    }
    return any;
}

}  // namespace gonio
