// The parts of the glTF importer: each turns one kind of object of a checked document into the scene's own structs.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/assets/assets.h"
#include "server/assets/gltf_document.h"
#include "server/scene/scene.h"

namespace tinygltf {
class Value;
struct Material;
struct TextureInfo;
class Node;
}  // namespace tinygltf

namespace gonio {

// Limits on what a small file may grow into; beyond them: "too_large".
inline constexpr std::size_t kMaxSceneIndices = std::size_t{1} << 28;    // over all meshes
inline constexpr std::size_t kMaxSceneTriangles = std::size_t{1} << 24;  // per instance: some 150 bytes each to trace
inline constexpr std::size_t kMaxSceneInstances = std::size_t{1} << 20;
inline constexpr std::size_t kMaxSceneTexels = std::size_t{1} << 28;  // over all images

// Memory of each, with what is made of it, measured and rounded up. Counted are a file's bytes while it is read,
// texels, vertices and corners. Triangles count where an instance shows them (BVH, clusters, surfaces of links).
inline constexpr std::size_t kBytesOfByte = 3, kBytesOfTexel = 32, kBytesOfVertex = 96, kBytesOfIndex = 12,
                             kBytesOfTriangle = 160, kBytesOfProfile = 3 << 19, kBytesOfColor = 72,
                             kBytesOfTangent = 176, kBytesOfSecondUv = 32;
// Takes `count` times so much off the room. Result: why not, "too_large"; then the room is as it was.
std::optional<Error> take_memory(std::size_t& room, std::size_t count, std::size_t bytes_each,
                                 const std::string& where);

// How a material places its texture on a mesh: the texture coordinate set, and KHR_texture_transform as
// uv' = linear * uv + offset. It is baked into the vertices.
struct UvPlacement {
    int set = 0;
    glm::mat2 linear{1.0f};
    glm::vec2 offset{0.0f};
    bool operator==(const UvPlacement&) const = default;
};

// What one import has gathered so far.
struct GltfImport {
    const GltfDocument& document;
    SceneAsset& scene;
    const LoadOptions& options;
    std::size_t room;                              // bytes that may still be taken (take_memory)
    std::vector<UvPlacement> uv_of_material;       // parallel to scene.materials
    std::map<std::pair<int, bool>, int> images;    // glTF image, Image::linear -> index into scene.images
    std::vector<std::vector<int>> meshes_of_mesh;  // glTF mesh -> indices into scene.meshes, one per primitive
    std::map<int, int> mirrored;                   // of a mesh and its copy, both indices into scene.meshes
    std::vector<int> camera_indices;               // the glTF's, parallel to scene.cameras
    std::map<std::pair<double, double>, std::shared_ptr<const Profile>> spots;  // by inner and outer cone, rad
    std::map<int, std::shared_ptr<const Profile>> ies_profiles;                 // by root light of EXT_lights_ies
    // Of the limits above. decoded: vertices that were read; vertices: those that were kept.
    std::size_t texels = 0, decoded = 0, vertices = 0, indices = 0, triangles = 0, instanced = 0;

    // Adds a warning once, at most kMaxWarnings in all; the last says whether those left out change lux.
    void warn(std::string sentence);
    static constexpr std::size_t kMaxWarnings = 100;
};

// Each fills its part of the scene. Result: nothing, or the error of load_scene.
std::optional<Error> import_materials(GltfImport& import);
std::optional<Error> import_meshes(GltfImport& import);
// After the meshes: materials whose alpha is 1 everywhere do not blend, which would cost time.
std::optional<Error> settle_blending(GltfImport& import);
// After blending is settled: once a feature, with the first of the materials that meshes show.
std::optional<Error> warn_of_materials(GltfImport& import);
std::optional<Error> import_nodes(GltfImport& import);
// Sets tangents from the texture coordinates; a vertex where the texture turns over becomes two.
void derive_tangents(Mesh& mesh);

// A material's base colour, as glTF's core or KHR_materials_pbrSpecularGlossiness has it.
struct BaseColour {
    std::array<double, 4> factor{1.0, 1.0, 1.0, 1.0};
    int texture = -1;
    UvPlacement uv;
};
BaseColour base_colour_of(const tinygltf::Material& material);
UvPlacement placement_of(const tinygltf::TextureInfo& texture);
// Result: a number of an extension's object, or the fallback where it has none. Its type was checked.
double number_of(const tinygltf::Value& object, const char* member, double fallback);
// Makes a material that has its own colour whatever the light into what `unlit` says.
void make_unlit(Material& material, Unlit unlit);

// EXT_mesh_gpu_instancing. Result: of the node's instances, in its own space; the identity alone without the
// extension. Errors: "bad_gltf", "out_of_bounds", "too_large".
Result<std::vector<glm::dmat4>> instances_of(GltfImport& import, const tinygltf::Node& node, const std::string& where);

// A node as its light sees it.
struct LightNode {
    int index = 0;
    glm::dvec3 position{0.0};
    glm::dquat world_from_light{1.0, 0.0, 0.0, 0.0};
};
// Adds the light that the node carries, if any. Errors: "bad_profile", "missing_file", "bad_gltf", "too_large".
std::optional<Error> import_node_light(GltfImport& import, const LightNode& node);

// bytes: a whole PNG, JPEG or WebP file: 1 to 4 channels, palette, 8 or 16 bit. max_pixels: what the caller can still
// hold. Result: RGBA, 8 bit, colour as encoded in the file (sRGB), alpha straight. where: place for errors. Errors:
// "bad_image", "too_large".
Result<Image> decode_image(std::span<const std::byte> bytes, const std::string& where, std::size_t max_pixels);

}  // namespace gonio
