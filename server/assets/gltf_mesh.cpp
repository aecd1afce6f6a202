// glTF meshes -> Mesh, one per primitive of triangles.
#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/type_ptr.hpp>
#include <limits>
#include <numeric>
#include <string>

#include "server/assets/assets.h"
#include "server/assets/gltf_features.h"
#include "server/assets/gltf_finite.h"
#include "server/assets/gltf_import.h"
#include "server/assets/mesh_builder.h"

namespace gonio {
namespace {

using Indices = std::vector<std::uint32_t>;

// glTF 2.0, 3.7.2.1 "Overview": strips and fans as lists. Triangles that repeat an index have no area and are left out.
Indices as_triangles(const Indices& in, int mode) {
    Indices out;
    const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        if (a != b && b != c && c != a) out.insert(out.end(), {a, b, c});
    };
    const std::size_t n = in.size();
    if (mode == TINYGLTF_MODE_TRIANGLES) {
        out.reserve(n);
        for (std::size_t i = 0; i + 2 < n; i += 3) add(in[i], in[i + 1], in[i + 2]);
    } else if (mode == TINYGLTF_MODE_TRIANGLE_STRIP) {
        for (std::size_t i = 0; i + 2 < n; ++i) add(in[i], in[i + 1 + i % 2], in[i + 2 - i % 2]);
    } else {
        for (std::size_t i = 0; i + 2 < n; ++i) add(in[i + 1], in[i + 2], in[0]);
    }
    return out;
}

glm::dvec3 area_normal(const Mesh& mesh, std::size_t triangle) {
    const auto corner = [&](std::size_t k) {
        return glm::dvec3(mesh.vertices[mesh.indices[3 * triangle + k]].position);
    };
    return glm::cross(corner(1) - corner(0), corner(2) - corner(0));
}

// Flat normals: every triangle gets vertices of its own. Triangles without area have no normal and are left out.
void make_flat(Mesh& mesh) {
    Mesh flat;
    flat.material = mesh.material;
    flat.vertices.reserve(mesh.indices.size());
    const bool colored = !mesh.colors.empty();
    for (std::size_t t = 0; t < mesh.indices.size() / 3; ++t) {
        const glm::dvec3 normal = area_normal(mesh, t);
        const double size = glm::length(normal);
        if (!(size > 0.0) || !std::isfinite(size)) continue;
        for (std::size_t k = 0; k < 3; ++k) {
            Vertex vertex = mesh.vertices[mesh.indices[3 * t + k]];
            if (colored) flat.colors.push_back(mesh.colors[mesh.indices[3 * t + k]]);
            if (!mesh.second_uv.empty()) flat.second_uv.push_back(mesh.second_uv[mesh.indices[3 * t + k]]);
            vertex.normal = glm::vec3(normal / size);
            flat.indices.push_back(static_cast<std::uint32_t>(flat.vertices.size()));
            flat.vertices.push_back(vertex);
        }
    }
    mesh = std::move(flat);
}

// Normals of length 0 become the area-weighted mean of the faces around the vertex; all others get unit length.
// Result: how many were 0.
std::size_t repair_normals(Mesh& mesh) {
    std::size_t repaired = 0;
    std::vector<glm::dvec3> around;
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        glm::dvec3 normal(mesh.vertices[i].normal);
        if (!(glm::length(normal) > 1e-6)) {
            if (around.empty()) {
                around.resize(mesh.vertices.size(), glm::dvec3(0.0));
                for (std::size_t t = 0; t < mesh.indices.size() / 3; ++t) {
                    for (std::size_t k = 0; k < 3; ++k) around[mesh.indices[3 * t + k]] += area_normal(mesh, t);
                }
            }
            ++repaired;
            normal = glm::length(around[i]) > 0.0 ? around[i] : glm::dvec3(0.0, 1.0, 0.0);
        }
        mesh.vertices[i].normal = glm::vec3(glm::normalize(normal));
    }
    return repaired;
}

// Leaves only vertices that a triangle uses: primitives often share one large array.
void compact(Mesh& mesh) {
    constexpr std::uint32_t unused = std::numeric_limits<std::uint32_t>::max();
    std::vector<std::uint32_t> new_index(mesh.vertices.size(), unused);
    std::vector<Vertex> kept;
    std::vector<glm::u16vec4> colors;
    std::vector<glm::vec4> tangents;
    std::vector<glm::vec2> second_uv;
    for (std::uint32_t& index : mesh.indices) {
        if (new_index[index] == unused) {
            new_index[index] = static_cast<std::uint32_t>(kept.size());
            kept.push_back(mesh.vertices[index]);
            if (!mesh.colors.empty()) colors.push_back(mesh.colors[index]);
            if (!mesh.tangents.empty()) tangents.push_back(mesh.tangents[index]);
            if (!mesh.second_uv.empty()) second_uv.push_back(mesh.second_uv[index]);
        }
        index = new_index[index];
    }
    mesh.vertices = std::move(kept);
    mesh.colors = std::move(colors);
    mesh.tangents = std::move(tangents);
    mesh.second_uv = std::move(second_uv);
}

Error too_large(const std::string& where, std::size_t value, const char* message) {
    return Error{"too_large", where, std::to_string(value), message};
}

std::optional<Error> check_elements(const GltfDocument& document, int accessor, std::size_t components,
                                    std::size_t count, const std::string& where) {
    if (accessor_components(document, accessor) != components) {
        return Error{"bad_gltf", where, std::to_string(accessor), "the accessor's type does not suit this attribute"};
    }
    if (accessor_count(document, accessor) != count) {
        return Error{"bad_gltf", where, std::to_string(accessor_count(document, accessor)),
                     "the attribute has not as many elements as there are positions"};
    }
    return std::nullopt;
}

// Result: values of an attribute with the wanted components and one element per vertex; not all need be finite.
Result<std::vector<float>> attribute(const GltfDocument& document, const tinygltf::Primitive& primitive,
                                     const std::string& name, std::size_t components, std::size_t count,
                                     const std::string& where) {
    const int accessor = primitive.attributes.at(name);
    if (auto error = check_elements(document, accessor, components, count, where + "/attributes/" + name))
        return *error;
    return read_any_floats(document, accessor);
}

// COLOR_0; where all are white the mesh needs none.
std::optional<Error> read_colors(GltfImport& import, const tinygltf::Primitive& primitive, Mesh& mesh,
                                 const std::string& where) {
    const auto found = primitive.attributes.find("COLOR_0");
    if (found == primitive.attributes.end()) return std::nullopt;
    const std::size_t count = mesh.vertices.size(),
                      components = accessor_components(import.document, found->second) == 3 ? 3 : 4;
    if (auto full = take_memory(import.room, count, kBytesOfColor, where + "/attributes/COLOR_0")) return full;
    auto values = attribute(import.document, primitive, "COLOR_0", components, count, where);
    if (!values) return values.error();
    if (mend_values(*values, components, mesh, 1.0f))
        import.warn("vertex colours that are no numbers are white; changes lux (" + where + ")");
    if (std::all_of(values->begin(), values->end(), [](float value) { return value == 1.0f; })) return std::nullopt;
    if (std::any_of(values->begin(), values->end(), [](float value) { return value < 0.0f || value > 1.0f; }))
        import.warn("vertex colours outside 0..1 were clamped; changes lux (" + where + ")");
    mesh.colors.resize(count, glm::u16vec4(65535));
    for (std::size_t i = 0; i < count; ++i) {
        for (std::size_t c = 0; c < components; ++c)
            mesh.colors[i][static_cast<int>(c)] = static_cast<std::uint16_t>(
                std::lround(65535.0f * std::clamp((*values)[components * i + c], 0.0f, 1.0f)));
    }
    return std::nullopt;
}

// What a normal map needs: TANGENT, which counts beside NORMAL only. Where the file has none the mesh gets its own
// later.
std::optional<Error> read_tangents(GltfImport& import, const tinygltf::Primitive& primitive, Mesh& mesh,
                                   const std::string& where) {
    if (import.scene.materials[mesh.material].normal_image < 0) return std::nullopt;
    const std::size_t count = mesh.vertices.size();
    if (auto full = take_memory(import.room, count, kBytesOfTangent, where)) return full;
    if (!primitive.attributes.count("TANGENT") || !primitive.attributes.count("NORMAL")) return std::nullopt;
    auto values = attribute(import.document, primitive, "TANGENT", 4, count, where);
    if (!values) return values.error();
    const bool mended = mend_values(*values, 4, mesh, 0.0f);
    const std::vector<bool> used = vertices_used(mesh);
    bool all_good = !mended;
    for (std::size_t i = 0; i < count; ++i) {
        const glm::vec3 along = glm::make_vec3(&(*values)[4 * i]);
        const bool good = glm::length(along) > 1e-6f;
        all_good = all_good && (good || !used[i]);
        mesh.tangents.emplace_back(good ? glm::normalize(along) : glm::vec3(1.0f, 0.0f, 0.0f),
                                   (*values)[4 * i + 3] < 0.0f ? -1.0f : 1.0f);
    }
    if (all_good) return std::nullopt;
    mesh.tangents.clear();
    import.warn(std::string("tangents ") + (mended ? "that are no numbers" : "of length 0") +
                " were rebuilt from the texture coordinates; changes lux (" + where + ")");
    return std::nullopt;
}

// TEXCOORD_1 as it is, whatever a material does with it.
std::optional<Error> read_second_uv(GltfImport& import, const tinygltf::Primitive& primitive, Mesh& mesh,
                                    const std::string& where) {
    if (!primitive.attributes.count("TEXCOORD_1")) return std::nullopt;
    const std::size_t count = mesh.vertices.size();
    if (auto full = take_memory(import.room, count, kBytesOfSecondUv, where + "/attributes/TEXCOORD_1")) return full;
    auto values = attribute(import.document, primitive, "TEXCOORD_1", 2, count, where);
    if (!values) return values.error();
    if (mend_values(*values, 2, mesh, 0.0f))
        import.warn("texture coordinates TEXCOORD_1 that are no numbers are 0 (" + where + ")");
    for (std::size_t i = 0; i < count; ++i) mesh.second_uv.push_back(glm::make_vec2(&(*values)[2 * i]));
    return std::nullopt;
}

std::optional<Error> read_vertices(GltfImport& import, const tinygltf::Primitive& primitive, Mesh& mesh,
                                   const std::string& where) {
    const std::size_t count = accessor_count(import.document, primitive.attributes.at("POSITION"));
    // Before anything is allocated: a sparse accessor may claim any count.
    import.decoded += count;
    if (import.decoded > 4 * kMaxSceneVertices || count > kMaxSceneVertices) {
        return too_large(where + "/attributes/POSITION", count, "the scene has too many vertices");
    }
    if (auto full = take_memory(import.room, count, kBytesOfVertex, where + "/attributes/POSITION")) return full;
    const auto positions = attribute(import.document, primitive, "POSITION", 3, count, where);
    if (!positions) return positions.error();
    mesh.vertices.resize(count);
    for (std::size_t i = 0; i < count; ++i)
        mesh.vertices[i] = {glm::make_vec3(&(*positions)[3 * i]), glm::vec3(0.0f), glm::vec2(0.0f)};
    if (primitive.attributes.count("NORMAL")) {
        const auto normals = attribute(import.document, primitive, "NORMAL", 3, count, where);
        if (!normals) return normals.error();
        for (std::size_t i = 0; i < count; ++i) mesh.vertices[i].normal = glm::make_vec3(&(*normals)[3 * i]);
    }
    const UvPlacement& placed = import.uv_of_material[mesh.material];
    const std::string set = "TEXCOORD_" + std::to_string(placed.set);
    if (primitive.attributes.count(set)) {
        const auto uv = attribute(import.document, primitive, set, 2, count, where);
        if (!uv) return uv.error();
        for (std::size_t i = 0; i < count; ++i)
            mesh.vertices[i].uv = placed.linear * glm::make_vec2(&(*uv)[2 * i]) + placed.offset;
    } else if (import.scene.materials[mesh.material].base_color_image >= 0) {
        import.warn("a textured primitive has no texture coordinates " + set + "; changes lux (" + where + ")");
    }
    return std::nullopt;
}

std::optional<Error> read_triangles(GltfImport& import, const tinygltf::Primitive& primitive, Mesh& mesh,
                                    const std::string& where) {
    const std::size_t count =
        primitive.indices >= 0 ? accessor_count(import.document, primitive.indices) : mesh.vertices.size();
    import.indices += 3 * count;  // what a strip may grow into
    if (import.indices > 3 * kMaxSceneIndices)
        return too_large(where + "/indices", count, "the scene has too many indices");
    if (auto full = take_memory(import.room, count, kBytesOfIndex, where + "/indices")) return full;
    Indices indices;
    if (primitive.indices >= 0) {
        auto read = read_indices(import.document, primitive.indices);
        if (!read) return read.error();
        indices = std::move(*read);
        const auto beyond = std::find_if(indices.begin(), indices.end(),
                                         [&](std::uint32_t index) { return index >= mesh.vertices.size(); });
        if (beyond != indices.end()) {
            return Error{"out_of_bounds", where + "/indices", std::to_string(*beyond),
                         "index " + std::to_string(beyond - indices.begin()) + " is beyond the " +
                             std::to_string(mesh.vertices.size()) + " vertices"};
        }
    } else {
        indices.resize(count);
        std::iota(indices.begin(), indices.end(), 0u);
    }
    if (primitive.mode == TINYGLTF_MODE_TRIANGLES && count % 3 != 0) {
        import.warn("the number of indices is no multiple of 3: the rest was left out (" + where + ")");
    }
    mesh.indices = as_triangles(indices, primitive.mode);
    return std::nullopt;
}

// What the pose makes of the vertices: morph targets before the skin. Result: where a skinned mesh stands.
Result<std::optional<glm::dvec3>> take_pose(GltfImport& import, const tinygltf::Primitive& primitive,
                                            const MeshPose& pose, Mesh& mesh, const std::string& where) {
    if (auto error = morph_vertices(import, primitive, pose.weights, mesh, where)) return *error;
    if (pose.skin < 0) return std::optional<glm::dvec3>();
    if (!is_skinned(primitive)) {
        import.warn("a primitive without joints or weights is placed by its node, not by the skin; changes lux (" +
                    where + ")");
        return std::optional<glm::dvec3>();
    }
    const auto origin = skin_vertices(import, primitive, pose.skin, mesh, where);
    if (!origin) return origin.error();
    return std::optional<glm::dvec3>(*origin);
}

std::optional<Error> import_primitive(GltfImport& import, const tinygltf::Primitive& primitive, const MeshPose& pose,
                                      const std::string& where) {
    if (primitive.mode < 0 || primitive.mode > TINYGLTF_MODE_TRIANGLE_FAN) {
        return Error{"bad_gltf", where + "/mode", std::to_string(primitive.mode), "there is no such primitive mode"};
    }
    if (primitive.mode < TINYGLTF_MODE_TRIANGLES) {
        import.warn(feature_warning("points and lines", where));
        return std::nullopt;
    }
    if (!primitive.attributes.count("POSITION")) {
        import.warn("a primitive without positions was left out; changes lux (" + where + ")");
        return std::nullopt;
    }
    Mesh mesh;
    mesh.material = primitive.material >= 0 ? primitive.material : static_cast<int>(import.scene.materials.size()) - 1;
    if (auto error = read_vertices(import, primitive, mesh, where)) return error;
    if (auto error = read_triangles(import, primitive, mesh, where)) return error;
    if (mesh.indices.empty()) {
        import.warn("a primitive without triangles was left out (" + where + ")");
        return std::nullopt;
    }
    mend_vertices(import, mesh, where);
    if (mesh.indices.empty()) return std::nullopt;
    // Read after the triangles: a value that is no number matters only at a vertex that one of them uses.
    if (auto error = read_colors(import, primitive, mesh, where)) return error;
    if (auto error = read_tangents(import, primitive, mesh, where)) return error;
    if (auto error = read_second_uv(import, primitive, mesh, where)) return error;
    const auto origin = take_pose(import, primitive, pose, mesh, where);
    if (!origin) return origin.error();
    if (primitive.attributes.count("NORMAL")) {
        compact(mesh);
        const bool mended = mend_normals(mesh);
        if (repair_normals(mesh) > 0)
            import.warn(std::string("normals ") + (mended ? "that are no numbers" : "of length 0") +
                        " were rebuilt from the faces; changes lux (" + where + ")");
    } else {
        make_flat(mesh);
    }
    const std::string uv = "TEXCOORD_" + std::to_string(import.uv_of_material[mesh.material].set);
    if (import.scene.materials[mesh.material].normal_image >= 0 && primitive.attributes.count(uv)) {
        if (mesh.tangents.empty()) derive_tangents(mesh);
    } else {
        mesh.tangents.clear();
    }
    import.vertices += mesh.vertices.size();
    if (import.vertices > kMaxSceneVertices)
        return too_large(where, import.vertices, "the scene has too many vertices");
    if (mesh.indices.empty()) return std::nullopt;
    measure(mesh);
    import.meshes_of_pose[pose].push_back({static_cast<int>(import.scene.meshes.size()), *origin});
    import.scene.meshes.push_back(std::move(mesh));
    return std::nullopt;
}

}  // namespace

Result<std::vector<float>> read_elements(const GltfDocument& document, int accessor, std::size_t components,
                                         std::size_t count, const std::string& where) {
    if (auto error = check_elements(document, accessor, components, count, where)) return *error;
    return read_floats(document, accessor);
}

std::optional<Error> import_meshes(GltfImport& import) {
    const auto& meshes = import.document.model->meshes;
    std::vector<std::vector<MeshPose>> poses(meshes.size());
    for (const tinygltf::Node& node : import.document.model->nodes) {
        if (node.mesh < 0) continue;
        MeshPose pose = pose_of(import, node);
        if (import.meshes_of_pose.try_emplace(pose).second) poses[node.mesh].push_back(std::move(pose));
    }
    for (std::size_t i = 0; i < meshes.size(); ++i) {
        if (poses[i].empty()) poses[i].push_back({static_cast<int>(i), -1, {}});  // no node shows it
        for (const MeshPose& pose : poses[i]) {
            for (std::size_t k = 0; k < meshes[i].primitives.size(); ++k) {
                const std::string where = "/meshes/" + std::to_string(i) + "/primitives/" + std::to_string(k);
                if (auto error = import_primitive(import, meshes[i].primitives[k], pose, where)) return error;
            }
        }
    }
    return std::nullopt;
}

}  // namespace gonio
