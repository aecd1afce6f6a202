// The scene: plain data with one owner, the render thread. No GL, no sockets, no file formats.
// World: metres, right-handed, +Y up (glTF). Positions are double; they are rebased to the camera or the light before
// single precision sees them. Meshes, images and webs are immutable and shared.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "ies/lm63.h"
#include "protocol/schema/messages.h"
#include "server/scene/gel.h"
#include "server/scene/haze.h"
#include "server/scene/orientation.h"

namespace gonio {

namespace trace {
class Geometry;
}  // namespace trace
namespace lighting {
struct Drawn;
}  // namespace lighting
struct Bodies;
struct LightTables;
struct AssetFiles;  // asset_files.h
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

// What a texture shows beyond 0..1, as glTF's samplers have it: its edge, itself again, or itself turned over.
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

// What is made of a profile once it is asked for (light_tables.h). A copy of the profile makes its own.
struct LightTablesOnce {
    mutable std::mutex mutex;
    mutable std::shared_ptr<const LightTables> made;
    LightTablesOnce() = default;
    LightTablesOnce(const LightTablesOnce&) {}
    LightTablesOnce& operator=(const LightTablesOnce&) = delete;
    bool operator==(const LightTablesOnce&) const { return true; }
};

struct PackedGobo;

// A slot of a luminaire's wheel: how much of the light a picture in the gate lets through.
struct Gobo {
    std::string name;
    int size_px = 0;                             // of each side; 0: it has no picture and is open
    std::vector<std::uint16_t> transmission{};   // rows from the top, 65535: all passes; ask transmission_of()
    std::shared_ptr<const PackedGobo> packed{};  // packed_gobo.h; null: the transmission is as it stands
    bool operator==(const Gobo&) const = default;
};
using Gobos = std::vector<Gobo>;

// A profile as lights share it.
struct Profile {
    std::string name;
    ies::Photometry photometry;
    double peak_cd = 0.0;                // of the web
    double flux_lm = 0.0;                // its integral
    bool uploaded = false;               // by a client
    std::shared_ptr<const Gobos> gobos;  // of its wheel; null: it has none
    LightTablesOnce tables;
    double open_width_rad = 0.0;  // of half the peak without the picture that is in the web; 0: there is none in it
    bool operator==(const Profile&) const = default;
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
    std::optional<double> exposure_ev100;       // that suits the scene, where its maker knows; else it is metered
    double scale = 1.0;                         // that its file was loaded with
    std::shared_ptr<const v1::SetPatch> patch;  // of consoles, that its file brings; null: none
    std::shared_ptr<const AssetFiles> files;    // that it was read from; null: none
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

using Revision = std::uint32_t;

// What can be set of a light, and a preset keeps: light_values.h.
struct LightValues {
    glm::dvec3 position{0.0};
    glm::dquat world_from_light{1.0, 0.0, 0.0, 0.0};
    double pan_rad = 0.0, tilt_rad = 0.0, roll_rad = 0.0;  // as last set, or derived from the orientation
    double level_ratio = 1.0;
    glm::dvec3 color{1.0};
    double cct_k = 0.0, tint_duv = 0.0;  // white.h
    double shutter_ratio = 1.0, strobe_hz = 0.0;
    double zoom_rad = 0.0, gobo = 0.0, gobo_rad = 0.0;  // shaped_profile.h
    std::shared_ptr<const Gel> gel;                     // null: none
    std::shared_ptr<const Profile> profile;
    std::optional<ies::Opening> opening;  // luminous; none: what the profile says (opening.h)
};

// What is made of a profile by a light's zoom and gobo: shaped_profile.h.
struct Shaping {
    double zoom_rad = 0.0;  // 0: as it is
    int gobo = 0;           // 0: open
    double gobo_rad = 0.0;
    bool operator==(const Shaping&) const = default;
};

struct Light : LightValues {
    std::uint32_t id = 0;  // never reused within a process; a scene's lights are in its order
    std::string name;
    int seed = -1;     // index into SceneAsset::lights of what it was made of; -1: it was added
    bool sun = false;  // its light is parallel, along its aim; `multiplier` is lux, the position has no effect
    double multiplier = 1.0;
    // What pan, tilt and roll turn about: orientation = world_from_mount · orientation_of(pan, tilt, roll). None but of
    // an imported head.
    glm::dquat world_from_mount{1.0, 0.0, 0.0, 0.0};
    std::shared_ptr<const Profile> shaped;  // of `shaped_of`, which follows zoom and gobo; null: the profile as it is
    std::pair<std::shared_ptr<const Profile>, Shaping> shaped_of;
    bool flash_off = false;  // of its strobe, now (strobe.h)
    bool missing = false;    // its fixture is not in the MVR show that was merged last: it is dark
    int imported = -1;       // index into Imported::lights of Scene::imported; -1: it is none of an MVR show
    // Result: what it shines with.
    const std::shared_ptr<const Profile>& shining() const { return shaped ? shaped : profile; }
    double tilt_factor = 1.0;  // LM-63 TILT=INCLUDE: all candela at the luminaire's tilt; follows aim and profile
    Revision position_rev = 0, aim_rev = 0, profile_rev = 0, level_rev = 0, name_rev = 0;
};

struct PresetLight : LightValues {
    std::string name;
};
using Preset = std::vector<PresetLight>;

struct Cue;                                               // cue.h
using CueList = std::vector<std::shared_ptr<const Cue>>;  // by number, each once
using CueNumber = std::uint32_t;                          // thousandths; 0: no cue
enum class TimecodeSource : std::uint8_t { off, mtc, artnet };
struct CueOptions {
    double guard_s = 0.2;  // a GO so soon after another is refused
    double back_s = 1.0;
    double freewheel_s = 1.0;  // how long time goes on when time code ends
    TimecodeSource timecode = TimecodeSource::off;
    bool operator==(const CueOptions&) const = default;
};

enum class View : std::uint8_t {
    beauty,
    direct,
    indirect,
    illuminance,
    luminance,
    mask,
    rsm_depth,
    rsm_normal,
    rsm_flux,
    solid
};
// Whether a view shows the scene from the camera, lit: all but those of a luminaire's cube.
inline bool shows_lit_surfaces(View view) {
    return view < View::mask || view == View::solid;
}
enum class Technique : std::uint8_t { standard, seed, seed_disk };
inline constexpr std::uint32_t kDefaultVpls = 4096;  // `samples` of the default technique
inline constexpr std::uint32_t kDefaultSeedSamples =
    400;  // `samples` of the seed technique: its paper's better setting

// How values become colours in the view illuminance, in lx, or luminance, in cd/m²: false_color.h.
struct FalseColor {
    double range_low = 1.0, range_high = 1e4;
    bool range_auto = false;
    bool logarithmic = true;
    unsigned steps = 0;  // 0: smooth
    std::string palette = "classic";
    bool isolux = false;
    std::vector<double> levels;  // that its lines have instead of the scale's; ascending
    double below = 0.0;          // what is less is marked; 0: nothing is
    double compare_range = 500.0;
    bool operator==(const FalseColor&) const = default;
};

// What becomes of exposed luminance in beauty, direct and indirect.
enum class Tone : std::uint8_t { knee, linear, aces, agx, neutral };
struct Look {
    Tone tone = Tone::knee;
    double white_k = 0.0;    // correlated colour temperature of what is white; 0: D65
    double white_duv = 0.0;  // that off the Planckian locus
    bool operator==(const Look&) const = default;
};

struct Scene {
    std::shared_ptr<const SceneAsset> asset;
    std::shared_ptr<const trace::Geometry> traced;  // of `asset`; null: whoever needs it makes one
    std::shared_ptr<const lighting::Drawn> drawn;   // of `traced`; likewise
    std::vector<Light> lights;
    std::map<std::string, std::vector<std::string>> groups;  // name -> light names
    std::shared_ptr<const v1::SetPatch> patch;               // of consoles; null: the default patch
    std::shared_ptr<const v1::SetSurfaces> surfaces;         // of fader boxes; null: what their profiles say
    std::map<std::string, std::shared_ptr<const Preset>> presets;
    std::string recalled;                 // the preset that was saved or recalled last; empty: none
    std::shared_ptr<const CueList> cues;  // null: none
    CueOptions cue_options;
    CueNumber cue_active = 0;          // the cue that was started last; it may be gone since
    CueNumber cue_next = 0;            // that GO starts
    std::shared_ptr<const Gels> gels;  // of `goniod --gels`, beside the built-in ones; null: none
    std::string show_name;             // of the file that it was saved to or opened from last; empty: none
    Camera camera;
    std::map<std::string, Camera> saved_views;
    std::map<std::string, std::shared_ptr<const v1::Grid>> grids;          // apply_grid.h has checked them
    std::map<std::string, std::shared_ptr<const v1::Observer>> observers;  // likewise
    View view = View::beauty;
    double view_gain = 1.0;
    std::string view_light;  // empty: the first light
    std::array<FalseColor, 2> false_color{
        FalseColor{}, FalseColor{.range_low = 0.1, .range_high = 1e3, .compare_range = 50.0}};  // in lx, in cd/m²
    std::string view_only;         // the light that those two views show alone; empty: all
    std::string view_compare;      // the preset that they show the difference from; empty: none
    bool emission_hidden = false;  // of emissive surfaces there is no light: of shown_scene() only
    Look look;
    HazeValues haze;
    bool work_light = true;  // wanted where nothing else lights the scene
    double exposure_ev100 = 6.0;
    bool exposure_auto = true;  // until somebody sets it
    double master_ratio = 1.0;
    Technique technique = Technique::standard;
    std::uint32_t samples = kDefaultVpls;
    int width_px = 800, height_px = 800;

    Revision scene_rev = 1;  // bumped by every command that changed anything
    // Revision of a part: the scene_rev of the command that last changed it.
    Revision geometry_rev = 1, camera_rev = 1, view_rev = 1, exposure_rev = 1, master_rev = 1, technique_rev = 1,
             size_rev = 1, lights_rev = 1 /* a light came, went or got another name */, groups_rev = 1, patch_rev = 1,
             surfaces_rev = 1, presets_rev = 1, saved_views_rev = 1, look_rev = 1, grids_rev = 1, observers_rev = 1,
             haze_rev = 1, cues_rev = 1 /* the list */, cue_play_rev = 1 /* options, active, next */,
             compare_rev = 1 /* what it compares with is another preset, or was saved anew */;
    Revision show_rev = 1;    // that the show's file holds, or the scene began with; 0: none
    Revision edited_rev = 1;  // that changed last what the show keeps; what consoles drive does not count
    std::uint32_t next_light_id = 1;
    std::shared_ptr<const Imported> imported;  // that the MVR show said last, of lights that are gone too; null: none
};

// Surfaces up to this luminance merely glow: a file's emissiveFactor goes so far, its emissive strength beyond.
inline constexpr float kMostGlow_nit = 1.0f;

// Whether the beauty view of live pictures and stills shows the work light: surfaces shaded towards the camera. It does
// where surfaces at most glow and there is no luminaire, or nothing but luminaires, whose bodies are seen then. It is
// no light of the scene: meters, captured values, references and other views know nothing of it.
inline bool needs_work_light(const Scene& scene) {
    if (!scene.work_light || (!scene.lights.empty() && !scene.asset->instances.empty())) return false;
    for (const Material& material : scene.asset->materials)
        if (glm::any(glm::greaterThan(material.emissive_nit, glm::vec3(kMostGlow_nit)))) return false;
    return true;
}
// The same of the live picture, as its view is.
inline bool work_light_on(const Scene& scene) {
    return scene.view == View::beauty && needs_work_light(scene);
}

inline constexpr double kMostMultiplier = 1e9;
inline constexpr std::size_t kMaxLights = 1024;                         // one more is refused: "too_many_lights"
inline constexpr std::size_t kMaxGroups = 64;                           // likewise "too_many_groups"
inline constexpr std::size_t kMaxPresets = 256;                         // likewise "too_many_presets"
inline constexpr std::size_t kMaxCues = 1000;                           // likewise "too_many_cues"
inline constexpr std::size_t kMaxCueLights = kMaxPresets * kMaxLights;  // that all cues keep: "too_large"
inline constexpr std::size_t kMaxSavedViews = 64;                       // likewise "too_many_views"
inline constexpr std::size_t kMaxGrids = 64;                            // likewise "too_many_grids"
inline constexpr std::size_t kMaxObservers = 16;                        // likewise "too_many_observers"
inline constexpr std::size_t kMaxNameBytes = 128;
// Lights of which a picture keeps each one's irradiance apart. The seed technique does of all, in 20 bytes a pixel: a
// size or light that would take more than this in all is refused: "too_large".
inline constexpr std::size_t kMostLayers = 64;
inline constexpr std::size_t kLayerBytesPerPixel = 20;
inline constexpr std::size_t kMaxLayerBytes = std::size_t{4} << 30;

}  // namespace gonio
