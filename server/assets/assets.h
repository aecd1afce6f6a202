// Files and generators -> immutable CPU structs of the scene. No GL. Third-party readers stay in the .cpp files.
// Every function is pure but for reading the named files, and may run on any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "ies/core/result.h"
#include "server/scene/asset.h"
#include "server/scene/asset_files.h"

namespace gonio {

inline constexpr std::size_t kMaxSceneFileBytes = std::size_t{1} << 30;  // .gltf, .glb and each buffer: "too_large"
inline constexpr std::size_t kMaxSceneVertices = std::size_t{1} << 26;   // over all meshes: "too_large"
inline constexpr int kMaxImagePx = 8192;                                 // per side: "too_large"
// Of surfaces in files, per channel. glTF's default is 1, and light between such walls never ends; white paint has 0.9.
inline constexpr double kMaxAlbedo = 0.95;

// Of a file's lengths: metres a unit. glTF's unit is the metre.
inline constexpr double kLeastScale = 1e-6, kMostScale = 1e6;

// What a KHR_materials_unlit surface is, whose colour no light changes: one that reflects it, or one that emits it.
enum class Unlit : std::uint8_t { albedo, emission };

// How scene files are taken.
struct LoadOptions {
    double max_albedo = kMaxAlbedo;  // surfaces reflect no more, 0..1: it is bounded, and a warning says of how many
    Unlit unlit = Unlit::albedo;
    bool show_backs = false;  // of all surfaces; else those of one side have no back for viewers, as glTF says
    double scale = 1.0;       // from kLeastScale to kMostScale, about the world's origin, as scale_scene() says
    int universe_offset = 0;  // added to the universes that a show's file gives its fixtures; up to kMostUniverseOffset
};
inline constexpr int kMostUniverseOffset = 63'998;  // either way: sACN has universes 1 to 63,999

// name: "cornell", "atrium" or "cylinder" (generated in code), or the path of a .gltf or .glb.
// Errors: "not_found", "bad_gltf", "out_of_bounds", "missing_file" (a buffer), "too_large", "unsupported",
// "invalid_argument" (scale). Images and photometric files that cannot be read are left out with a warning. Their
// `where` is a JSON pointer into the glTF ("/accessors/3/byteOffset") or a file name. The scene, and its file in
// errors, are called `shown` instead of `name`; empty: `name`. Memory for a file's scene is at most `most_bytes` while
// it is read, and with what the renderer makes of it. What would be more is refused before it is taken: "too_large". A
// scene of over 200 m or under 0.1 m has a warning.
Result<std::shared_ptr<const SceneAsset>> load_scene(const std::string& name, const std::string& shown = "",
                                                     const LoadOptions& options = {},
                                                     std::size_t most_bytes = SIZE_MAX);

// bytes: a .glb, or a .gltf, whose uris are data: only. shown: its name in the scene and in errors. Scale and
// show_backs of the options are the caller's. room: of memory, of which it takes its part. Errors as of load_scene. Any
// thread.
Result<std::shared_ptr<const SceneAsset>> read_glb(std::span<const std::byte> bytes, const std::string& shown,
                                                   const LoadOptions& options, std::size_t& room);

// folder: absolute. files: of the scene, from the folder, the scene's own first; some may stand there twice. Result:
// what whoever lacks them needs; null where they are more than kMostAssetFiles or one cannot be read. Takes as long as
// the disk.
inline constexpr std::size_t kMostAssetFiles = 4096;
std::shared_ptr<const AssetFiles> hashed_files(const std::filesystem::path& folder,
                                               const std::vector<std::filesystem::path>& files);

// Result: docs/gltf.md: what is made of each of glTF's features and extensions.
std::string gltf_features_text();

// The built-in scenes, metres. cornell: a room with two boxes and a sculpture of about 33,000 triangles in all; atrium:
// a colonnaded court of at least 262,000 triangles, textured. Both with one luminaire and one camera. The cylinder: the
// inside of a closed cylinder of so many facets, radius 8 m, 40 m long, with six linear luminaires on its wall.
std::shared_ptr<const SceneAsset> make_cornell();
std::shared_ptr<const SceneAsset> make_atrium();
inline constexpr int kCylinderFacets = 96;  // a multiple of 3: a strip lies in the middle of one
std::shared_ptr<const SceneAsset> make_cylinder(int facets = kCylinderFacets);
// Result: whether load_scene generates the scene of this name.
bool is_built_in(const std::string& name);

// bytes: a photometric file. Result: the profile lights share. Errors of ies::read_photometry.
Result<std::shared_ptr<const Profile>> make_profile(std::string name, std::string_view bytes);
// Result: the same of photometry that is no file's.
std::shared_ptr<const Profile> make_profile(std::string name, ies::Photometry photometry);
// The profile of a luminaire whose photometric file cannot be read: no light. Its diagnostics say why.
std::shared_ptr<const Profile> unlit_profile(std::string name, std::string code, std::string why);
// name: of ies::synthetic_luminaires. Errors: "not_found".
Result<std::shared_ptr<const Profile>> builtin_profile(const std::string& name);
// The profile of a plain KHR_lights_punctual light of 1 cd on its axis: isotropic, or a spot with its smooth cone edge.
std::shared_ptr<const Profile> punctual_point_profile();
// Of a directional light, which has no intensity: 1 for 1 lx.
std::shared_ptr<const Profile> sun_profile();
std::shared_ptr<const Profile> punctual_spot_profile(double inner_cone_rad, double outer_cone_rad);
// Of a plain EXT_lights_area light of 1 cd/m²: Lambertian, from a flat opening, a rectangle or an ellipse.
std::shared_ptr<const Profile> panel_profile(const ies::Opening& opening);

// Pixels of one captured picture, row-major from the top.
struct FloatPicture {
    int width_px = 0, height_px = 0, channels = 3;  // 3: scene-linear RGB; 1: Y
    std::vector<float> values;
    std::vector<float> haze;  // the layer "haze", scene-linear RGB, 3 a pixel; empty: there is none
};
struct BytePicture {
    int width_px = 0, height_px = 0;
    std::vector<std::uint8_t> rgb;  // 3 bytes per pixel, sRGB-encoded
};
// Result: the bytes of the image file. EXR: 32-bit float, or half, unit named in the header attribute "gonio:unit";
// denoised: it has "gonio:denoised" 1.
Result<std::vector<std::byte>> encode_exr(const FloatPicture& picture, const std::string& unit, bool denoised = false,
                                          bool half = false);
Result<std::vector<std::byte>> encode_png(const BytePicture& picture);
Result<std::vector<std::byte>> encode_rgba_png(const Image& image);  // with alpha
Result<std::vector<std::byte>> encode_jpeg(const BytePicture& picture, int quality_percent);
// Tests read captures back with these. path: PNG, JPEG or EXR.
Result<FloatPicture> read_picture(const std::string& path);

}  // namespace gonio
