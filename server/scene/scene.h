// The scene: plain data with one owner, the render thread. No GL, no sockets, no file formats.
// World: metres, right-handed, +Y up (glTF). Positions are double; they are rebased to the camera or the light before
// single precision sees them. Meshes, images and webs are immutable and shared.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "protocol/schema/messages.h"
#include "server/scene/asset.h"
#include "server/scene/cue.h"
#include "server/scene/gel.h"
#include "server/scene/haze.h"
#include "server/scene/light.h"
#include "server/scene/view.h"

namespace gonio {

namespace trace {
class Geometry;
}  // namespace trace
namespace lighting {
struct Drawn;
}  // namespace lighting
struct Imported;  // imported.h

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
    Camera home;  // that the scene began with: its file's first, else the one that was chosen for it
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
    bool size_auto = false;  // nobody has asked for a size: the first page that looks chooses one

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

}  // namespace gonio
