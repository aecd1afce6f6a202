// Models of shows and of fixture types: GLB and 3DS files -> meshes of a scene.
#include <cmath>

#include "server/assets/gltf_import.h"
#include "server/assets/mesh_builder.h"
#include "server/exchange/import_parts.h"
#include "server/exchange/mesh_3ds.h"

namespace gonio::exchange {
namespace {

constexpr double kUnit_m = 0.001;  // of a 3DS model
Result<Model> take_glb(ShowImport& import, SceneAsset& scene, const std::string& bytes, const std::string& entry) {
    auto read = read_glb(std::as_bytes(std::span(bytes)), entry, import.options, import.room);
    if (!read) return read.error();
    const SceneAsset& from = **read;
    const int images = static_cast<int>(scene.images.size()), materials = static_cast<int>(scene.materials.size()),
              meshes = static_cast<int>(scene.meshes.size());
    scene.images.insert(scene.images.end(), from.images.begin(), from.images.end());
    for (Material material : from.materials) {
        for (int* image : {&material.base_color_image, &material.emissive_image, &material.normal_image,
                           &material.transmission_image})
            if (*image >= 0) *image += images;
        scene.materials.push_back(std::move(material));
    }
    for (Mesh mesh : from.meshes) {
        mesh.material += materials;
        scene.meshes.push_back(std::move(mesh));
    }
    Model model;
    for (const Instance& instance : from.instances)
        model.parts.push_back({instance.mesh + meshes, -1, instance.world_from_mesh});
    if (!from.lights.empty()) import.report.add(Outcome::left_out, "lights of a model", entry);
    for (const std::string& warning : from.warnings) {
        // A warning that several models share is one line, with each one's place: "…; changes lux: "a.glb
        // (/materials/0)"".
        std::size_t place = warning.find(" (/");
        if (place == std::string::npos && warning.ends_with(')')) place = warning.rfind(" (");
        import.report.add(Outcome::guessed, warning.substr(0, place),
                          place == std::string::npos ? entry : entry + warning.substr(place));
    }
    return model;
}

Result<Model> take_3ds(ShowImport& import, SceneAsset& scene, const std::string& bytes, const std::string& entry) {
    const auto read = read_3ds(bytes);
    if (!read) return read.error();
    if (auto full = take_memory(import.room, 3 * read->triangles(), kBytesOfVertex + kBytesOfIndex, entry))
        return *full;
    std::vector<int> material_of(read->materials.size() + 1, -1);  // the last: of faces without one
    Model model;
    for (const Mesh3ds::Part& part : read->parts) {
        const std::size_t which = part.material >= 0 ? static_cast<std::size_t>(part.material) : read->materials.size();
        if (material_of[which] < 0) {
            const Mesh3ds::Material made =
                part.material >= 0 ? read->materials[which] : Mesh3ds::Material{"3DS", glm::vec3(0.5f)};
            const auto most = static_cast<float>(import.options.max_albedo);
            material_of[which] = add_material(scene, made.name, glm::min(made.color, glm::vec3(most)));
            scene.materials.back().double_sided = true;  // exporters turn faces either way
        }
        Mesh mesh;
        for (std::size_t i = 0; i + 2 < part.positions.size(); i += 3) {
            glm::dvec3 corner[3];
            for (std::size_t k = 0; k < 3; ++k) {
                const glm::dvec3 at(part.positions[i + k]);
                corner[k] = glm::dvec3(at.x, at.z, -at.y) * kUnit_m;
            }
            const glm::vec3 normal(glm::normalize(glm::cross(corner[1] - corner[0], corner[2] - corner[0])));
            if (!std::isfinite(normal.x)) continue;
            for (const glm::dvec3& one : corner) {
                mesh.indices.push_back(static_cast<std::uint32_t>(mesh.vertices.size()));
                mesh.vertices.push_back({glm::vec3(one), normal, glm::vec2(0.0f)});
            }
        }
        if (mesh.indices.empty()) continue;
        model.parts.push_back({add_mesh(scene, std::move(mesh), material_of[which])});
    }
    const auto note = [&](std::size_t count, const char* what) {
        if (count > 0)
            import.report.add(Outcome::left_out, what,
                              entry + " (" + std::to_string(count) + " of " + std::to_string(read->faces()) + ")");
    };
    note(read->left_out.no_point, "faces of a 3DS model with points that do not exist");
    note(read->left_out.not_finite, "faces of a 3DS model with points that are not finite, or beyond 1e9");
    if (model.parts.empty()) note(read->left_out.no_area, "faces of a 3DS model without area");
    if (read->bytes_behind > 0)
        import.report.add(Outcome::left_out, "bytes behind the main chunk of a 3DS model",
                          entry + " (" + std::to_string(read->bytes_behind) + ")");
    return model;
}

}  // namespace

Result<Model> take_model(ShowImport& import, SceneAsset& scene, const std::string& bytes, const std::string& entry) {
    if (auto full = take_memory(import.room, bytes.size(), 1, entry)) return *full;
    auto model =
        bytes.starts_with("MM") ? take_3ds(import, scene, bytes, entry) : take_glb(import, scene, bytes, entry);
    if (model && model->parts.empty()) import.report.add(Outcome::left_out, "a model has no faces", entry);
    return model;
}

// Result: the corners of a mesh's box.
std::array<glm::dvec3, 2> box_of(const Mesh& mesh) {
    std::array<glm::dvec3, 2> box{glm::dvec3(0.0), glm::dvec3(0.0)};
    for (const Vertex& vertex : mesh.vertices) {
        box[0] = glm::min(box[0], glm::dvec3(vertex.position));
        box[1] = glm::max(box[1], glm::dvec3(vertex.position));
    }
    return box;
}

bool is_placed(const glm::dmat4& matrix, const std::array<glm::dvec3, 2>& box) {
    for (int k = 0; k < 8; ++k) {
        const glm::dvec3 corner(box[k & 1].x, box[k >> 1 & 1].y, box[k >> 2 & 1].z);
        if (!is_within(glm::dvec3(matrix * glm::dvec4(corner, 1.0)))) return false;
    }
    return std::abs(glm::determinant(glm::dmat3(matrix))) > 1e-30;
}

}  // namespace gonio::exchange
