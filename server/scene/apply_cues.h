// The part of apply() that edits the list of cues, and that brings a preset's or a cue's content about.
#pragma once

#include "server/scene/apply.h"
#include "server/scene/cue.h"

namespace gonio::v1 {
class CueEdit;
class SetCueOptions;
}  // namespace gonio::v1

namespace gonio {

struct Scene;

// Each throws Refused (apply_checks.h) and has then changed nothing but a copy. loaded.preset: a content that was read
// from a file.
void add_cue(Scene& scene, const v1::CueEdit& edit, const Loaded& loaded);
void set_cue(Scene& scene, const v1::CueEdit& edit);
void remove_cue(Scene& scene, const std::string& number);
void set_cue_options(Scene& scene, const v1::SetCueOptions& set);

// GO, BACK, GOTO and assert, as they are without a CuePlayer: the cue is there at once. With loaded.cue the command is
// CuePlayer's: that cue becomes the active one, and its profiles and gels are there.
void play_cue(Scene& scene, const v1::Command& command, const Loaded& loaded);
// Result: the cue that the command means, which is there. Throws Refused: "not_found", "invalid_argument".
CueNumber cue_meant(const Scene& scene, const v1::Command& command);

// Profiles and gels of the lights that are there; where it does not fade all else too.
void bring_about(Scene& scene, const Preset& preset, bool fades);

}  // namespace gonio
