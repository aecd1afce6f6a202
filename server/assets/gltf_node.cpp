// The node tree of a glTF scene -> instances, cameras and the positions of lights, in double.
#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>
#include <string>

#include "protocol/text/shortened_text.h"
#include "server/assets/assets.h"
#include "server/assets/gltf_features.h"
#include "server/assets/gltf_import.h"
#include "server/assets/mesh_builder.h"
#include "server/scene/limits.h"

namespace gonio {
namespace {

constexpr double kMinFov_rad = 0.02, kMaxFov_rad = 3.0;  // as of set_camera

// The rotation nearest to what the axes do to -Z and +X: -Z is kept exactly, so that a light or camera under a mirrored
// or skewed parent aims where the parent's geometry does.
glm::dquat orientation(const glm::dmat3& axes) {
    const double depth = glm::length(axes[2]);
    if (!(depth > 1e-12)) return {1.0, 0.0, 0.0, 0.0};
    const glm::dvec3 z = axes[2] / depth;
    glm::dvec3 x = axes[0] - z * glm::dot(axes[0], z);
    if (!(glm::length(x) > 1e-12)) x = glm::cross(std::abs(z.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0), z);
    x = glm::normalize(x);
    return glm::normalize(glm::quat_cast(glm::dmat3(x, glm::cross(z, x), z)));
}

// Those of the listed nodes that no other one of them shows, each once.
std::vector<int> shown_once(GltfImport& import, const std::vector<int>& listed, const std::vector<bool>& child) {
    const auto& nodes = import.document.model->nodes;
    std::vector<bool> shown(nodes.size());
    bool repeats = false;
    std::vector<int> open;
    for (const int root : listed) {
        repeats |= child[root];
        open.insert(open.end(), nodes[root].children.begin(), nodes[root].children.end());
    }
    while (!open.empty()) {
        const int index = open.back();
        open.pop_back();
        if (shown[index]) continue;
        shown[index] = true;
        open.insert(open.end(), nodes[index].children.begin(), nodes[index].children.end());
    }
    std::vector<int> result;
    for (const int root : listed) {
        if (!shown[root]) result.push_back(root);
        repeats |= shown[root];
        shown[root] = true;
    }
    if (repeats) import.warn(feature_warning("root nodes that are children"));
    return result;
}

// The default scene's, else the first's; a file without scenes shows all nodes that have no parent.
std::vector<int> roots(GltfImport& import) {
    const tinygltf::Model& model = *import.document.model;
    std::vector<bool> child(model.nodes.size());
    for (const auto& node : model.nodes) {
        for (const int index : node.children) child[index] = true;
    }
    if (!model.scenes.empty()) {
        if (model.defaultScene < 0 && model.scenes.size() > 1) import.warn("several scenes: the first is shown");
        return shown_once(import, model.scenes[std::max(model.defaultScene, 0)].nodes, child);
    }
    std::vector<int> result;
    for (std::size_t i = 0; i < child.size(); ++i) {
        if (!child[i]) result.push_back(static_cast<int>(i));
    }
    return result;
}

// A transform of negative determinant turns counter-clockwise triangles round, and the cofactors that carry normals
// turn these round too. The copy has both turned beforehand, so that they face the front again in the world.
int mirrored(GltfImport& import, int mesh) {
    const auto [known, is_new] = import.mirrored.emplace(mesh, static_cast<int>(import.scene.meshes.size()));
    if (!is_new) return known->second;
    Mesh copy = import.scene.meshes[mesh];
    for (std::size_t i = 0; i + 2 < copy.indices.size(); i += 3) std::swap(copy.indices[i + 1], copy.indices[i + 2]);
    for (Vertex& vertex : copy.vertices) vertex.normal = -vertex.normal;
    for (glm::vec4& tangent : copy.tangents) tangent.w = -tangent.w;
    import.scene.meshes.push_back(std::move(copy));
    return known->second;
}

// mesh: an index into scene.meshes.
std::optional<Error> add_mesh_of(GltfImport& import, const tinygltf::Node& node, int mesh, const glm::dmat4& world,
                                 const std::string& where) {
    auto& scene = import.scene;
    const std::size_t count = scene.meshes[mesh].indices.size() / 3;
    import.triangles += count;
    if (import.triangles > kMaxSceneTriangles || scene.instances.size() >= kMaxSceneInstances) {
        return Error{"too_large", where + "/mesh", std::to_string(node.mesh),
                     "the scene has too many instances or triangles"};
    }
    if (auto full = take_memory(import.room, count, kBytesOfTriangle, where + "/mesh")) return full;
    add_instance(scene, mesh, node.name, world);
    return std::nullopt;
}

std::optional<Error> add_meshes(GltfImport& import, const tinygltf::Node& node, const std::vector<PosedMesh>& meshes,
                                const glm::dmat4& world, const std::string& where) {
    const glm::dmat3 axes(world);
    const double volume = glm::dot(axes[0], glm::cross(axes[1], axes[2]));
    const double size = glm::length(axes[0]) * glm::length(axes[1]) * glm::length(axes[2]);
    if (!(std::abs(volume) > 1e-12 * size)) {
        import.warn("a mesh that its node flattens was left out; changes lux (" + where + ")");
        return std::nullopt;
    }
    for (const PosedMesh& posed : meshes) {
        const int facing = volume > 0.0 ? posed.mesh : mirrored(import, posed.mesh);
        if (auto error = add_mesh_of(import, node, facing, world, where)) return error;
    }
    return std::nullopt;
}

std::optional<Error> add_instances(GltfImport& import, const tinygltf::Node& node, const glm::dmat4& world,
                                   const std::string& where) {
    if (node.mesh < 0) return std::nullopt;
    std::vector<PosedMesh> placed_by_node;
    bool skinned = false;
    for (const PosedMesh& posed : import.meshes_of_pose[pose_of(import, node)]) {
        if (!posed.origin) {
            placed_by_node.push_back(posed);
            continue;
        }
        skinned = true;
        const glm::dmat4 there = glm::translate(glm::dmat4(1.0), *posed.origin);
        if (auto error = add_mesh_of(import, node, posed.mesh, there, where)) return error;
    }
    const auto instances = instances_of(import, node, where);
    if (!instances) return instances.error();
    if (skinned && instances->size() != 1)
        import.warn("a skinned mesh stands once, where its joints put it; changes lux (" + where + ")");
    if (placed_by_node.empty()) return std::nullopt;
    for (const glm::dmat4& node_from_instance : *instances) {
        const glm::dmat4 placed = world * node_from_instance;
        if (!is_placeable(placed)) return Error{"bad_gltf", where, node.name, "an instance's place is too far"};
        if (auto error = add_meshes(import, node, placed_by_node, placed, where)) return error;
    }
    return std::nullopt;
}

void add_camera(GltfImport& import, const tinygltf::Node& node, const glm::dvec3& eye, const glm::dquat& turn,
                const std::string& where) {
    if (node.camera < 0) return;
    const auto& camera = import.document.model->cameras[node.camera];
    if (camera.type != "perspective") {
        import.warn(feature_warning("orthographic cameras", where));
        return;
    }
    if ((turn * glm::dvec3(0.0, 1.0, 0.0)).y < std::abs((turn * glm::dvec3(1.0, 0.0, 0.0)).y)) {
        import.warn("the camera's roll was ignored: +Y is up in every picture (" + where + ")");
    }
    import.scene.cameras.push_back({eye, eye + turn * glm::dvec3(0.0, 0.0, -1.0), camera.perspective.yfov});
    import.scene.camera_names.push_back(shortened_text(node.name.empty() ? camera.name : node.name, kMaxNameBytes));
    import.camera_indices.push_back(node.camera);
}

// Fields of view; and targets, which move to the depth of the scene's middle so that orbiting feels right.
std::optional<Error> check_cameras(GltfImport& import) {
    measure(import.scene);
    const Bounds& bounds = import.scene.bounds;
    for (std::size_t i = 0; i < import.scene.cameras.size(); ++i) {
        Camera& camera = import.scene.cameras[i];
        const std::string where = "/cameras/" + std::to_string(import.camera_indices[i]) + "/perspective/yfov";
        if (!(camera.fov_rad > 0.0 && camera.fov_rad < std::numbers::pi)) {
            return Error{"bad_gltf", where, std::to_string(camera.fov_rad),
                         "the field of view must lie between 0 and pi"};
        }
        if (camera.fov_rad < kMinFov_rad || camera.fov_rad > kMaxFov_rad) {
            import.warn("a field of view was moved into 0.02 to 3 rad (" + where + ")");
            camera.fov_rad = std::clamp(camera.fov_rad, kMinFov_rad, kMaxFov_rad);
        }
        if (import.scene.instances.empty()) continue;
        const glm::dvec3 forward = camera.target - camera.eye;
        const double depth = glm::dot((bounds.min + bounds.max) * 0.5 - camera.eye, forward);
        if (depth > 1.0) camera.target = camera.eye + forward * depth;
    }
    return std::nullopt;
}

}  // namespace

std::optional<Error> import_nodes(GltfImport& import) {
    struct Visit {
        int node;
        glm::dmat4 world_from_parent;
        bool shown;  // by those above it
    };
    std::vector<Visit> open;
    const std::vector<int> first = roots(import);
    for (auto it = first.rbegin(); it != first.rend(); ++it) open.push_back({*it, glm::dmat4(1.0), true});
    while (!open.empty()) {
        const Visit visit = open.back();
        open.pop_back();
        const auto& node = import.document.model->nodes[visit.node];
        const std::string where = "/nodes/" + std::to_string(visit.node);
        const auto local = transform_of(node, where);
        if (!local) return local.error();
        const glm::dmat4 world = visit.world_from_parent * local->matrix;
        if (!is_placeable(world))
            return Error{"bad_gltf", where, node.name, "the node's place is not finite or too far"};
        const Result<bool> shown = visit.shown ? is_visible(import, visit.node) : Result<bool>(false);
        if (!shown) return shown.error();
        if (*shown)
            if (auto error = add_instances(import, node, world, where)) return error;
        const glm::dquat turn = orientation(glm::dmat3(visit.world_from_parent) * local->axes);
        add_camera(import, node, glm::dvec3(world[3]), turn, where);
        const double scale = std::max(
            {glm::length(glm::dvec3(world[0])), glm::length(glm::dvec3(world[1])), glm::length(glm::dvec3(world[2]))});
        if (*shown)
            if (auto error = import_node_light(import, {visit.node, glm::dvec3(world[3]), turn, scale})) return error;
        for (auto it = node.children.rbegin(); it != node.children.rend(); ++it) open.push_back({*it, world, *shown});
    }
    return check_cameras(import);
}

}  // namespace gonio
