// apply: the only writer of the scene. A command changes everything it names or, on an error, nothing.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "ies/core/result.h"
#include "protocol/schema/messages.h"
#include "server/scene/asset.h"
#include "server/scene/cue.h"
#include "server/scene/light.h"
#include "server/scene/view.h"

namespace gonio {

namespace trace {
class Geometry;
}  // namespace trace
namespace lighting {
struct Drawn;
}  // namespace lighting
struct EditTarget;
struct Scene;

// What a command's files turned into, read off the render thread before the command is applied; of undo and redo, what
// they set back.
struct Loaded {
    std::shared_ptr<const SceneAsset> asset;        // of load_scene
    std::shared_ptr<const Profile> profile;         // of set_light or add_light
    std::shared_ptr<const Preset> preset;           // of save_preset: this one instead of the lights as they are
    std::shared_ptr<const trace::Geometry> traced;  // of `asset`, or null
    std::shared_ptr<const lighting::Drawn> drawn;   // of `traced`, or null
    std::optional<double> exposure_ev100;           // metered of `asset`, where it has none of its own
    std::shared_ptr<const Scene> opened;  // of open_show; of undo and redo: the scene that comes back, or null
    std::vector<std::string> warnings;  // of `opened`: what could not be brought back; of `asset`: of its first picture
    std::shared_ptr<const std::vector<EditTarget>>
        targets;  // of undo and redo (edit.h), in the order of the keys; or null
    CueNumber cue =
        0;  // of cue_goto: CuePlayer brings its numbers about in time (cue_player.h); 0: all is there at once
    std::optional<Camera> camera;  // the first of `asset`, where its file has none
};

struct Applied {
    Revision scene_rev = 0;             // the revision that contains the change; unchanged if nothing differed
    std::vector<std::string> warnings;  // of the files that came with the command; of what had to give way
};

// Render thread. Errors: "invalid_argument" (out of range, not finite, not three numbers), "not_found" (light, group),
// "already_exists", "too_many_lights", "too_many_groups", "too_many_presets", "too_many_views", "too_many_cues",
// "too_large", "conflict" (aim beside pan/tilt/roll, follow beside hang), "unsupported". `where` is the field
// ("set_light.position_m"), `value` what it held.
Result<Applied> apply(Scene& scene, const v1::Command& command, const Loaded& loaded);

// Who moves values. What a console or a playing cue drives is of the moment: it is no change of the show, but for
// a preset that it saves.
enum class Driven : std::uint8_t { by_hand, by_console };
// Render thread. Carries out what consoles say in one frame: set_light of lights (not of groups, and without profile),
// set_master, set_exposure; all that differs gets one revision. Of a set_light that is refused each property is tried
// for itself, so that a bad one takes no other with it. Result: of each command why it, or the first bad property of
// it, was refused; nothing where all of it counts.
std::vector<std::optional<Error>> apply_inputs(Scene& scene, std::span<const v1::Command> commands,
                                               Driven driven = Driven::by_hand);

// Returns a camera that sees the whole of a box, from outside: from its right, from above and from its front.
Camera framing(const Bounds& bounds);

// Result: a scene that shows the asset from its first camera, with its own lights; revisions continue from `revision`.
// Without a camera it frames the bounds, until trace::first_view() has found a better one.
Scene scene_of(std::shared_ptr<const SceneAsset> asset, Revision revision = 1);

// Result: the nearest EV100 that set_exposure takes.
double within_exposure(double ev100);

// Result: level × multiplier × TILT factor × master × colour × white × gel: what the light's candela are multiplied by,
// per channel.
glm::dvec3 light_weight(const Scene& scene, const Light& light);
// The same without the master.
glm::dvec3 own_weight(const Light& light);

// Names of View and Technique on the wire; nullptr-free: every enum value has one.
const char* view_name(View view);
const char* technique_name(Technique technique);
bool parse_view(const std::string& name, View& view);

}  // namespace gonio
