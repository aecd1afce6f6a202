// Skins: vertices stand where their joints put them, at the rest pose.
#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <string>

#include "server/assets/gltf_import.h"

namespace gonio {
namespace {

constexpr std::size_t kBytesOfJoint = 256;   // its matrix and what it is read from
constexpr std::size_t kBytesOfWeights = 64;  // of a vertex and one set of four joints

// Where the node stands in the world. The nodes that were asked for are kept, so that a long chain is walked once.
Result<glm::dmat4> world_of_node(GltfImport& import, int node) {
    const auto& nodes = import.document.model->nodes;
    if (import.parents.empty()) {
        import.parents.assign(nodes.size(), -1);
        import.worlds.assign(nodes.size(), std::nullopt);
        for (std::size_t i = 0; i < nodes.size(); ++i)
            for (const int child : nodes[i].children) import.parents[child] = static_cast<int>(i);
    }
    std::vector<int> chain;
    for (; node >= 0 && !import.worlds[node]; node = import.parents[node]) chain.push_back(node);
    glm::dmat4 world = node >= 0 ? *import.worlds[node] : glm::dmat4(1.0);
    for (auto it = chain.rbegin(); it != chain.rend(); ++it) {
        const std::string where = "/nodes/" + std::to_string(*it);
        const auto own = transform_of(nodes[*it], where);
        if (!own) return own.error();
        world *= own->matrix;
        if (!is_placeable(world))
            return Error{"bad_gltf", where, nodes[*it].name, "the node's place is not finite or too far"};
        import.worlds[*it] = world;
    }
    return world;
}

Result<std::vector<float>> inverse_binds_of(GltfImport& import, const GltfSkin& skin, const std::string& where) {
    if (skin.inverse_bind_matrices < 0) return std::vector<float>{};
    const std::string place = where + "/inverseBindMatrices";
    const std::size_t count = accessor_count(import.document, skin.inverse_bind_matrices);
    if (count < skin.joints.size())
        return Error{"bad_gltf", place, std::to_string(count),
                     "the skin has " + std::to_string(skin.joints.size()) + " joints"};
    if (auto full = take_memory(import.room, count, kBytesOfJoint, place)) return *full;
    return read_elements(import.document, skin.inverse_bind_matrices, 16, count, place);
}

// glTF 2.0, 3.7.3.2 "Joint Hierarchy": the joint's global transform times its inverse bind matrix.
Result<JointPlaces> joint_places(GltfImport& import, int index) {
    const GltfSkin& skin = import.document.skins[index];
    const std::string where = "/skins/" + std::to_string(index);
    if (auto full = take_memory(import.room, skin.joints.size(), kBytesOfJoint, where)) return *full;
    const auto binds = inverse_binds_of(import, skin, where);
    if (!binds) return binds.error();
    JointPlaces places;
    for (std::size_t i = 0; i < skin.joints.size(); ++i) {
        auto world = world_of_node(import, skin.joints[i]);
        if (!world) return world.error();
        if (i == 0) places.origin = glm::dvec3((*world)[3]);
        (*world)[3] -= glm::dvec4(places.origin, 0.0);
        glm::dmat4 bind(1.0);
        if (!binds->empty()) {
            bind = glm::dmat4(glm::make_mat4(&(*binds)[16 * i]));
            for (int c = 0; c < 4; ++c) bind[c][3] = c < 3 ? 0.0 : 1.0;
        }
        places.from_mesh.push_back(*world * bind);
        if (!is_placeable(places.from_mesh.back()))
            return Error{"bad_gltf", where + "/joints/" + std::to_string(i), std::to_string(skin.joints[i]),
                         "what the joint binds is too far away"};
    }
    return places;
}

Result<const JointPlaces*> places_of(GltfImport& import, int skin) {
    const auto known = import.joints_of_skin.find(skin);
    if (known != import.joints_of_skin.end()) return &known->second;
    auto made = joint_places(import, skin);
    if (!made) return made.error();
    return &import.joints_of_skin.emplace(skin, std::move(*made)).first->second;
}

// One set of attributes: four joints a vertex, with their weights.
struct WeightSet {
    std::vector<float> joints, weights;
    std::string where;  // of the joints
};

Result<std::vector<WeightSet>> weight_sets(GltfImport& import, const tinygltf::Primitive& primitive, std::size_t count,
                                           const std::string& where) {
    std::vector<WeightSet> sets;
    for (int n = 0;; ++n) {
        const std::string names[] = {"JOINTS_" + std::to_string(n), "WEIGHTS_" + std::to_string(n)};
        const auto joints = primitive.attributes.find(names[0]), weights = primitive.attributes.find(names[1]);
        if (joints == primitive.attributes.end() || weights == primitive.attributes.end()) return sets;
        const std::string place = where + "/attributes/" + names[0];
        // Several sets may share their bytes: what they may take of time and memory is bounded here.
        import.decoded += count;
        if (import.decoded > 4 * kMaxSceneVertices)
            return Error{"too_large", place, std::to_string(count), "the scene has too many vertices"};
        if (auto full = take_memory(import.room, count, kBytesOfWeights, place)) return *full;
        if (import.document.model->accessors[joints->second].normalized)
            return Error{"bad_gltf", place, std::to_string(joints->second), "joints are indices, not normalised"};
        auto indices = read_elements(import.document, joints->second, 4, count, place);
        if (!indices) return indices.error();
        auto shares = read_elements(import.document, weights->second, 4, count, where + "/attributes/" + names[1]);
        if (!shares) return shares.error();
        sets.push_back({std::move(*indices), std::move(*shares), place});
    }
}

// The joints' matrices times their weights. Weights are made to sum to 1, as quantised ones do not quite. Where a
// vertex has none it follows its first joint; then `unweighted` is true.
Result<glm::dmat4> blended(const JointPlaces& places, const std::vector<WeightSet>& sets, std::size_t vertex,
                           bool& unweighted) {
    glm::dmat4 sum(0.0);
    double weights = 0.0;
    for (const bool by_weight : {true, false}) {
        for (const WeightSet& set : sets) {
            for (std::size_t k = 0; k < 4; ++k) {
                const float joint = set.joints[4 * vertex + k];
                const double weight = by_weight ? static_cast<double>(set.weights[4 * vertex + k]) : 1.0;
                if (!(weight > 0.0)) continue;
                if (!(joint >= 0.0f && joint < static_cast<float>(places.from_mesh.size())))
                    return Error{"out_of_bounds", set.where, std::to_string(std::lround(joint)),
                                 "vertex " + std::to_string(vertex) + " has a joint beyond the skin's " +
                                     std::to_string(places.from_mesh.size())};
                sum += weight * places.from_mesh[static_cast<std::size_t>(joint)];
                weights += weight;
                if (!by_weight) return sum;
            }
        }
        if (weights > 0.0) return sum / weights;
        unweighted = true;
    }
    return sum;
}

// The cofactors of the axes carry normals, but for the sign of their determinant.
glm::dvec3 turned_normal(const glm::dmat3& axes, bool mirrors, const glm::dvec3& normal) {
    const glm::dvec3 turned =
        glm::dmat3(glm::cross(axes[1], axes[2]), glm::cross(axes[2], axes[0]), glm::cross(axes[0], axes[1])) * normal;
    const double length = glm::length(turned);
    return length > 0.0 ? turned * ((mirrors ? -1.0 : 1.0) / length) : glm::dvec3(0.0);
}

}  // namespace

bool is_skinned(const tinygltf::Primitive& primitive) {
    return primitive.attributes.count("JOINTS_0") != 0 && primitive.attributes.count("WEIGHTS_0") != 0;
}

Result<glm::dvec3> skin_vertices(GltfImport& import, const tinygltf::Primitive& primitive, int skin, Mesh& mesh,
                                 const std::string& where) {
    const auto places = places_of(import, skin);
    if (!places) return places.error();
    const auto sets = weight_sets(import, primitive, mesh.vertices.size(), where);
    if (!sets) return sets.error();
    std::vector<bool> turned_over(mesh.vertices.size());
    bool unweighted = false, flat_tangents = false;
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        const auto matrix = blended(**places, *sets, i, unweighted);
        if (!matrix) return matrix.error();
        Vertex& vertex = mesh.vertices[i];
        const glm::dmat3 axes(*matrix);
        const glm::dvec3 position(*matrix * glm::dvec4(vertex.position, 1.0));
        for (int c = 0; c < 3; ++c)
            if (!(std::abs(position[c]) < 1e30))
                return Error{"bad_gltf", where, std::to_string(i), "the skin puts this vertex too far away"};
        turned_over[i] = glm::dot(axes[0], glm::cross(axes[1], axes[2])) < 0.0;
        vertex.position = glm::vec3(position);
        vertex.normal = glm::vec3(turned_normal(axes, turned_over[i], glm::dvec3(vertex.normal)));
        if (mesh.tangents.empty()) continue;
        glm::vec4& tangent = mesh.tangents[i];
        const glm::dvec3 along = axes * glm::dvec3(tangent);
        const double length = glm::length(along);
        flat_tangents |= !(length > 0.0);
        if (length > 0.0) tangent = glm::vec4(glm::vec3(along / length), turned_over[i] ? -tangent.w : tangent.w);
    }
    if (flat_tangents) mesh.tangents.clear();  // they are derived then
    if (unweighted) import.warn("vertices without weights follow their first joint; changes lux (" + where + ")");
    for (std::size_t t = 0; t + 2 < mesh.indices.size(); t += 3) {
        const int turned =
            turned_over[mesh.indices[t]] + turned_over[mesh.indices[t + 1]] + turned_over[mesh.indices[t + 2]];
        if (turned >= 2) std::swap(mesh.indices[t + 1], mesh.indices[t + 2]);
    }
    return (*places)->origin;
}

}  // namespace gonio
