// The contents of a scene file: meshes, materials, images, cameras, and lights as it describes them. Immutable and
// shared. World: metres, right-handed, +Y up (glTF).
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocol/schema/messages.h"
#include "server/scene/orientation.h"
#include "server/scene/profile.h"

namespace gonio {

struct AssetFiles;  // asset_files.h
struct Bodies;      // body.h
struct Imported;    // imported.h

struct Bounds {
    glm::dvec3 min{1e300};
    glm::dvec3 max{-1e300};
};

// 32 bytes, uploaded as it is.
struct Vertex {
    glm::vec3 position;  // mesh space, m
    glm::vec3 normal;    // mesh space, unit length
    glm::vec2 uv;
};

struct Image {
    int width_px = 0, height_px = 0;
    std::vector<std::uint8_t> rgba;  // row-major from the top, sRGB-encoded colour, linear alpha
    bool linear = false;             // its colours are values, not encoded
};

// How a texture goes on beyond 0..1, as in glTF's samplers: with its edge, repeated, or repeated and mirrored.
enum class Wrap : std::uint8_t { clamp, repeat, mirror };

struct Material {
    std::string name;
    glm::vec4 base_color{1.0f};  // linear Rec.709 reflectance 0..1 (glTF baseColorFactor), times the texture
    int base_color_image = -1;   // index into SceneAsset::images, -1: none
    Wrap wrap_s = Wrap::repeat, wrap_t = Wrap::repeat;
    glm::vec3 emissive_nit{0.0f};  // cd/m², glTF emissiveFactor × KHR_materials_emissive_strength
    int emissive_image = -1;
    int normal_image = -1;      // normals in tangent space, glTF normalTexture
    float normal_scale = 1.0f;  // of their x and y
    bool alpha_mask = false;
    float alpha_cutoff = 0.5f;
    bool alpha_blend = false;     // it covers as much as its alpha says
    float transmission = 0.0f;    // KHR_materials_transmission: of what it covers so much passes, times its colour
    int transmission_image = -1;  // whose red it is times; linear
    bool transmissive() const { return alpha_blend || transmission > 0.0f; }
    bool double_sided = false;
    bool show_back = false;  // viewers see its back though it has one side; light and emission know no difference
    bool culled_back() const { return !double_sided && !show_back; }
};

// One glTF primitive: triangles with one material.
struct Mesh {
    std::vector<Vertex> vertices;
    std::vector<glm::u16vec4> colors;  // like vertices: linear rgb and alpha times the base colour, 65535: 1; or empty
    // Like vertices, where its material has normals: unit, along u; w: ±1 times cross(normal, tangent) is up in the
    // texture; or empty.
    std::vector<glm::vec4> tangents;
    std::vector<glm::vec2> second_uv;    // like vertices: the file's TEXCOORD_1, which maps may use; or empty
    std::vector<std::uint32_t> indices;  // 3 per triangle, counter-clockwise from the front
    int material = 0;                    // index into SceneAsset::materials
    Bounds bounds;                       // mesh space
};

struct Instance {
    int mesh = 0;
    glm::dmat4 world_from_mesh{1.0};
    std::string node;  // glTF node name, for messages
};

// A light as a scene file describes it, before it becomes a Light of the running scene.
struct LightSeed {
    std::string name;
    glm::dvec3 position{0.0};
    glm::dquat world_from_light{1.0, 0.0, 0.0, 0.0};  // node frame: photometric zero on -Z, C0 on +X
    std::shared_ptr<const Profile> profile;
    double level_ratio = 1.0;
    double multiplier = 1.0;
    glm::dvec3 color{1.0};
    double cct_k = 0.0;                               // Light::cct_k
    bool sun = false;                                 // Light::sun
    glm::dquat world_from_mount{1.0, 0.0, 0.0, 0.0};  // Light::world_from_mount
    std::optional<PanTiltRoll> angles;                // of the orientation, as its console has them; else angles_of()
};

struct Camera {
    glm::dvec3 eye{0.0, 1.0, 5.0};
    glm::dvec3 target{0.0, 1.0, 0.0};
    double fov_rad = 0.7;  // vertical
};

// All that a scene file holds. Immutable.
struct SceneAsset {
    std::string name;  // "cornell", or the path it came from
    std::vector<Mesh> meshes;
    std::vector<Material> materials;  // at least one
    std::vector<Image> images;
    std::vector<Instance> instances;
    std::vector<LightSeed> lights;
    std::shared_ptr<const Bodies> bodies;       // of luminaires, body.h; null: there are none
    std::vector<Camera> cameras;                // may be empty: then one is framed from the bounds
    std::vector<std::string> camera_names;      // of the first of them; "": it has none
    std::optional<double> exposure_ev100;       // that suits the scene, where its maker knows; else it is metered
    double scale = 1.0;                         // that its file was loaded with
    std::shared_ptr<const v1::SetPatch> patch;  // of consoles, that its file brings; null: none
    std::shared_ptr<const AssetFiles> files;    // that it was read from; null: none
    std::vector<std::string> notes;             // what was understood of a show, for whoever loads it; a sentence each
    std::vector<std::string> warnings;          // tolerated deviations and unsupported features, one sentence each
    Bounds bounds;                              // world space
    std::size_t triangles() const {             // counted per instance
        std::size_t count = 0;
        for (const Instance& instance : instances) count += meshes[instance.mesh].indices.size() / 3;
        return count;
    }
    std::shared_ptr<const Imported> imported;  // what an MVR show says of its lights, in their order; null: it is none
    glm::dvec3 place{0.0};                     // of the file that is the origin here, m: far_place.h
};

}  // namespace gonio
