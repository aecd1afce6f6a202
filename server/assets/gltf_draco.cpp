// KHR_draco_mesh_compression: primitives' accessors get the bytes that their Draco mesh holds.
#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>

#include "server/assets/assets.h"
#include "server/assets/draco_mesh.h"
#include "server/assets/gltf_check.h"
#include "server/assets/gltf_expand.h"
#include "server/assets/gltf_import.h"

namespace gonio {
namespace {

using Json = nlohmann::json;

constexpr const char* kDraco = "KHR_draco_mesh_compression";
constexpr std::size_t kMostTimesSaid = 4;  // vertices and triangles that a mesh may have for each that accessors say
constexpr std::size_t kMostDecoderBytes = std::size_t{4} << 30;  // what the decoder may hold beside its result

bool has_bytes(const Json& accessor) {
    return accessor.contains("bufferView");
}

// The accessor reads these bytes from now on. They become a buffer.
void give_bytes(GltfExpansion& expansion, Json& accessor, std::size_t count, std::vector<std::byte> bytes) {
    Json& views = expansion.document["bufferViews"];
    accessor["bufferView"] = views.size();
    accessor["count"] = count;
    accessor.erase("byteOffset");
    views.push_back({{"buffer", expansion.buffers.size()}, {"byteLength", bytes.size()}});
    expansion.buffers.push_back(std::move(bytes));
}

// A primitive's accessors that Draco has the values of.
struct Wanted {
    std::vector<DracoAttribute> attributes;
    std::vector<std::size_t> accessors;  // parallel to attributes
};

Wanted wanted_of(const Json& accessors, const Json& primitive, const Json& compressed) {
    Wanted wanted;
    for (const auto& [name, id] : compressed["attributes"].items()) {
        const auto found = primitive["attributes"].find(name);
        if (found == primitive["attributes"].end()) continue;
        const auto index = found->get<std::size_t>();
        const Json& accessor = accessors[index];
        if (has_bytes(accessor) || std::count(wanted.accessors.begin(), wanted.accessors.end(), index)) continue;
        wanted.accessors.push_back(index);
        wanted.attributes.push_back({id.get<std::uint32_t>(), accessor["componentType"].get<int>(),
                                     component_count(accessor["type"].get<std::string>())});
    }
    return wanted;
}

// Of what is decoded.
std::size_t bytes_of(const Wanted& wanted, std::size_t faces, std::size_t points) {
    std::size_t bytes = faces * 3 * sizeof(std::uint32_t);
    for (const DracoAttribute& attribute : wanted.attributes)
        bytes += points * attribute.components * component_bytes(attribute.component_type);
    return bytes;
}

// An encoder splits vertices at seams, and some writers keep the counts from before: what the decoder finds counts.
std::size_t bound_of(std::size_t said, std::size_t most) {
    return std::min(kMostTimesSaid * said, most);
}

// So many bytes were taken for the faces and points that the accessors say. Where there is no memory for more, no more
// may come out.
DracoBounds bounds_of(const GltfExpansion& expansion, const Wanted& wanted, std::size_t faces, std::size_t points,
                      std::size_t taken) {
    DracoBounds bounds{bound_of(faces, kMaxSceneTriangles), bound_of(points, kMaxSceneVertices),
                       std::min(kMostDecoderBytes, expansion.room)};
    const std::size_t left = std::min(expansion.room, kMaxExpandedBytes - expansion.expanded);
    if (bytes_of(wanted, bounds.faces, bounds.points) - taken > left) bounds.faces = faces, bounds.points = points;
    return bounds;
}

std::optional<Error> expand(GltfExpansion& expansion, Json& primitive, const std::string& primitive_where) {
    const Json& compressed = primitive["extensions"][kDraco];
    const std::string where = primitive_where + "/extensions/" + kDraco;
    Json& accessors = expansion.document["accessors"];
    if (!primitive.contains("indices") || !primitive["attributes"].contains("POSITION"))
        return Error{"bad_gltf", primitive_where, "", "a Draco primitive names accessors for positions and indices"};
    Json& indices = accessors[primitive["indices"].get<std::size_t>()];
    const Wanted wanted = wanted_of(accessors, primitive, compressed);
    if (has_bytes(indices) && wanted.attributes.empty()) return std::nullopt;  // all is there without Draco

    const auto count = indices["count"].get<std::size_t>();
    const auto points = accessors[primitive["attributes"]["POSITION"].get<std::size_t>()]["count"].get<std::size_t>();
    const bool strip = primitive.value("mode", 4) == 5;
    const std::size_t faces = strip ? count - std::min<std::size_t>(count, 2) : count / 3;
    if (faces > kMaxSceneTriangles || points > kMaxSceneVertices)
        return Error{"too_large", where, std::to_string(std::max(faces, points)), "the Draco mesh is too large"};
    const std::size_t bytes = bytes_of(wanted, faces, points);
    if (auto full = take_expanded(expansion, bytes, where)) return full;

    const Json& view = expansion.document["bufferViews"][compressed["bufferView"].get<std::size_t>()];
    const auto held = std::span<const std::byte>(expansion.buffers[view["buffer"].get<std::size_t>()])
                          .subspan(view.value("byteOffset", std::size_t{0}), view["byteLength"].get<std::size_t>());
    auto mesh = decode_draco(held, wanted.attributes, bounds_of(expansion, wanted, faces, points, bytes), where);
    if (!mesh) return mesh.error();
    const std::size_t real = bytes_of(wanted, mesh->indices.size() / 3, mesh->points);
    if (real > bytes) {
        if (auto full = take_expanded(expansion, real - bytes, where)) return full;
    }
    if (mesh->points > points || mesh->indices.size() / 3 > faces)
        expansion.warnings.push_back("the Draco mesh is larger than its accessors say: it has " +
                                     std::to_string(mesh->points) + " vertices for " + std::to_string(points) + ", " +
                                     std::to_string(mesh->indices.size() / 3) + " triangles for " +
                                     std::to_string(faces) + " (" + where + ")");
    if (mesh->points < points || mesh->indices.size() / 3 < faces)
        expansion.warnings.push_back("the Draco mesh is smaller than its accessors say (" + where + ")");
    for (std::size_t i = 0; i < wanted.accessors.size(); ++i)
        give_bytes(expansion, accessors[wanted.accessors[i]], mesh->points, std::move(mesh->attributes[i]));
    if (has_bytes(indices)) return std::nullopt;
    std::vector<std::byte> packed(mesh->indices.size() * sizeof(std::uint32_t));
    std::memcpy(packed.data(), mesh->indices.data(), packed.size());
    indices["componentType"] = 5125;
    primitive["mode"] = 4;  // Draco's faces are a list, of strips too
    give_bytes(expansion, indices, mesh->indices.size(), std::move(packed));
    return std::nullopt;
}

}  // namespace

std::optional<Error> expand_draco(GltfExpansion& expansion) {
    if (!expansion.document.contains("meshes")) return std::nullopt;
    Json& meshes = expansion.document["meshes"];
    for (std::size_t i = 0; i < meshes.size(); ++i) {
        Json& primitives = meshes[i]["primitives"];
        for (std::size_t k = 0; k < primitives.size(); ++k) {
            Json& primitive = primitives[k];
            if (!primitive.contains("extensions") || !primitive["extensions"].contains(kDraco)) continue;
            const std::string where = "/meshes/" + std::to_string(i) + "/primitives/" + std::to_string(k);
            if (auto error = expand(expansion, primitive, where)) return error;
        }
    }
    return std::nullopt;
}

}  // namespace gonio
