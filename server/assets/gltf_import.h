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
#include "server/scene/asset.h"

namespace tinygltf {
class Value;
struct Material;
struct TextureInfo;
class Node;
struct Primitive;
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

// How a node shows its mesh: the same mesh stands otherwise by other weights of its morph targets, or another skin.
struct MeshPose {
    int mesh = 0;
    int skin = -1;                // GltfDocument::skins, -1: none
    std::vector<double> weights;  // of the morph targets; without the zeros at its end
    auto operator<=>(const MeshPose&) const = default;
};

// A primitive in its pose.
struct PosedMesh {
    int mesh = 0;                      // index into scene.meshes
    std::optional<glm::dvec3> origin;  // skinned: its place in the world, whatever the node's is
};

// A skin's joints: mesh -> world, from the origin, which is near the mesh so that single precision can hold it.
struct JointPlaces {
    glm::dvec3 origin{0.0};
    std::vector<glm::dmat4> from_mesh;  // by joint
};

// What one import has gathered so far.
struct GltfImport {
    const GltfDocument& document;
    SceneAsset& scene;
    const LoadOptions& options;
    std::size_t room;                                           // bytes that may still be taken (take_memory)
    std::vector<UvPlacement> uv_of_material;                    // parallel to scene.materials
    std::map<std::pair<int, bool>, int> images;                 // glTF image, Image::linear -> index into scene.images
    std::map<MeshPose, std::vector<PosedMesh>> meshes_of_pose;  // one per primitive
    std::map<int, JointPlaces> joints_of_skin;
    std::vector<int> parents;                       // by node, -1: none; empty until a skin asks
    std::vector<std::optional<glm::dmat4>> worlds;  // by node, of those that a skin asked for
    std::map<int, int> mirrored;                    // of a mesh and its copy, both indices into scene.meshes
    std::vector<int> camera_indices;                // the glTF's, parallel to scene.cameras
    std::map<std::pair<double, double>, std::shared_ptr<const Profile>> spots;  // by inner and outer cone, rad
    std::map<int, std::shared_ptr<const Profile>> ies_profiles;                 // by root light of EXT_lights_ies
    std::map<int, Error> dark_profiles;  // of these the dark ones: why their file cannot be read
    std::map<std::array<double, 3>, std::shared_ptr<const Profile>> panels;  // by shape, length and width, m
    // Of the limits above. decoded: vertices that were read; vertices: those that were kept.
    std::size_t texels = 0, decoded = 0, vertices = 0, indices = 0, triangles = 0, instanced = 0;

    // Adds a warning once, at most kMaxWarnings in all; the last says whether those left out change lux.
    void warn(std::string sentence);
    // Puts one before all others, whatever there are: of what a load says in one line.
    void warn_first(std::string sentence);
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

// A node's own transform. axes: without its own scale where it is stated apart. Errors: "bad_gltf".
struct NodeTransform {
    glm::dmat4 matrix{1.0};
    glm::dmat3 axes{1.0};
};
Result<NodeTransform> transform_of(const tinygltf::Node& node, const std::string& where);
// Result: whether single precision behind the seam holds what the matrix makes of points.
bool is_placeable(const glm::dmat4& matrix);

// How the node shows its mesh; it has one.
MeshPose pose_of(const GltfImport& import, const tinygltf::Node& node);
// KHR_node_visibility: whether the node shows what it has, as far as it says itself. Errors: "out_of_bounds",
// "too_large", "bad_gltf".
Result<bool> is_visible(GltfImport& import, int node);

// Result: the accessor's values, which must have so many components and elements. where: of what names it.
Result<std::vector<float>> read_elements(const GltfDocument& document, int accessor, std::size_t components,
                                         std::size_t count, const std::string& where);

// A mesh before its triangles are settled: every vertex of the primitive, normals of any length, tangents where its
// material needs them. Errors: of load_scene.
// Morph targets: adds so much of each to positions, normals and tangents.
std::optional<Error> morph_vertices(GltfImport& import, const tinygltf::Primitive& primitive,
                                    const std::vector<double>& weights, Mesh& mesh, const std::string& where);
// Whether the primitive's vertices name joints.
bool is_skinned(const tinygltf::Primitive& primitive);
// Moves the vertices to where the skin's joints put them, less the origin; triangles that joints mirror turn round, so
// that their front stays. Result: the origin.
Result<glm::dvec3> skin_vertices(GltfImport& import, const tinygltf::Primitive& primitive, int skin, Mesh& mesh,
                                 const std::string& where);

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
    double scale = 1.0;  // of the node in the world, the largest of its axes
};
// Adds the light that the node carries, if any. Errors: "bad_gltf", "too_large".
std::optional<Error> import_node_light(GltfImport& import, const LightNode& node);
// After the nodes: names the luminaires whose photometric file cannot be read.
std::optional<Error> warn_of_dark_lights(GltfImport& import);

// bytes: a whole PNG, JPEG or WebP file: 1 to 4 channels, palette, 8 or 16 bit. max_pixels: what the caller can still
// hold. Result: RGBA, 8 bit, colour as encoded in the file (sRGB), alpha straight. where: place for errors. Errors:
// "bad_image", "too_large".
Result<Image> decode_image(std::span<const std::byte> bytes, const std::string& where, std::size_t max_pixels);
// The same, without decoding it. Result: the size that the header says.
struct ImageSize {
    int width_px = 0, height_px = 0;
};
Result<ImageSize> image_size(std::span<const std::byte> bytes, const std::string& where, std::size_t max_pixels);

}  // namespace gonio
