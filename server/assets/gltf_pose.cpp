// How a node shows its mesh: whether at all, with which skin, and how far morph targets move the vertices.
#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/type_ptr.hpp>
#include <string>

#include "server/assets/gltf_import.h"

namespace gonio {
namespace {

constexpr const char* kVisibility = "KHR_node_visibility";

using Vectors = std::vector<float>;

// The morph target's displacements of one attribute; none where it has none.
Result<Vectors> displacements_of(GltfImport& import, const std::map<std::string, int>& target, const char* name,
                                 std::size_t count, const std::string& where) {
    const auto found = target.find(name);
    if (found == target.end()) return Vectors{};
    return read_elements(import.document, found->second, 3, count, where + "/" + name);
}

// Whether the target moves what is not morphed here.
bool has_others(const std::map<std::string, int>& target) {
    return std::any_of(target.begin(), target.end(), [](const auto& attribute) {
        return attribute.first != "POSITION" && attribute.first != "NORMAL" && attribute.first != "TANGENT";
    });
}

}  // namespace

MeshPose pose_of(const GltfImport& import, const tinygltf::Node& node) {
    const tinygltf::Mesh& mesh = import.document.model->meshes[node.mesh];
    MeshPose pose{node.mesh, -1, node.weights.empty() ? mesh.weights : node.weights};
    while (!pose.weights.empty() && pose.weights.back() == 0.0) pose.weights.pop_back();
    // The same mesh is shared by all skins that it does not heed.
    if (std::any_of(mesh.primitives.begin(), mesh.primitives.end(), is_skinned)) pose.skin = node.skin;
    return pose;
}

Result<bool> is_visible(GltfImport& import, int node) {
    const auto keys = import.document.visibility_keys.find(node);
    if (keys != import.document.visibility_keys.end()) {
        const std::size_t count = accessor_count(import.document, keys->second);
        const std::string where = "/accessors/" + std::to_string(keys->second);
        if (auto full = take_memory(import.room, count, sizeof(float), where)) return *full;
        const auto values = read_floats(import.document, keys->second);
        if (!values) return values.error();
        if (!values->empty()) return values->front() != 0.0f;
    }
    const auto& extensions = import.document.model->nodes[node].extensions;
    const auto own = extensions.find(kVisibility);
    return own == extensions.end() || !own->second.Has("visible") || own->second.Get("visible").Get<bool>();
}

std::optional<Error> morph_vertices(GltfImport& import, const tinygltf::Primitive& primitive,
                                    const std::vector<double>& weights, Mesh& mesh, const std::string& where) {
    if (weights.empty()) return std::nullopt;
    const std::size_t count = mesh.vertices.size();
    const bool has_normals = primitive.attributes.count("NORMAL") != 0;
    if (weights.size() > primitive.targets.size())
        import.warn("weights beyond the morph targets were left out; changes lux (" + where + ")");
    const std::size_t used = std::min(weights.size(), primitive.targets.size()),
                      moving = used - static_cast<std::size_t>(std::count(
                                          weights.begin(), weights.begin() + static_cast<std::ptrdiff_t>(used), 0.0));
    // Many targets may share their bytes: what they may take of time is bounded beforehand.
    import.decoded += 4 * moving * count;
    if (import.decoded > 4 * kMaxSceneVertices)
        return Error{"too_large", where + "/targets", std::to_string(moving),
                     "the scene has too many vertices in morph targets"};
    for (std::size_t k = 0; k < used; ++k) {
        if (weights[k] == 0.0) continue;
        const auto& target = primitive.targets[k];
        const std::string place = where + "/targets/" + std::to_string(k);
        if (has_others(target))
            import.warn("morph targets of other attributes were left out; changes lux (" + place + ")");
        const auto positions = displacements_of(import, target, "POSITION", count, place);
        if (!positions) return positions.error();
        const auto normals = has_normals ? displacements_of(import, target, "NORMAL", count, place) : Vectors{};
        if (!normals) return normals.error();
        const auto tangents =
            mesh.tangents.empty() ? Vectors{} : displacements_of(import, target, "TANGENT", count, place);
        if (!tangents) return tangents.error();
        const auto weight = static_cast<float>(std::clamp(weights[k], -1e30, 1e30));
        for (std::size_t i = 0; i < count; ++i) {
            Vertex& vertex = mesh.vertices[i];
            if (!positions->empty()) vertex.position += weight * glm::make_vec3(&(*positions)[3 * i]);
            if (!normals->empty()) vertex.normal += weight * glm::make_vec3(&(*normals)[3 * i]);
            if (!tangents->empty()) mesh.tangents[i] += glm::vec4(weight * glm::make_vec3(&(*tangents)[3 * i]), 0.0f);
        }
    }
    for (std::size_t i = 0; i < count; ++i)
        for (int c = 0; c < 3; ++c)
            if (!(std::abs(mesh.vertices[i].position[c]) < 1e30f))
                return Error{"bad_gltf", where + "/targets", std::to_string(i),
                             "the morph targets put this vertex too far away"};
    for (glm::vec4& tangent : mesh.tangents) {
        const float length = glm::length(glm::vec3(tangent));
        if (!(length > 1e-6f && length < 1e18f)) {
            mesh.tangents.clear();  // they are derived then
            break;
        }
        tangent = glm::vec4(glm::vec3(tangent) / length, tangent.w);
    }
    return std::nullopt;
}

}  // namespace gonio
