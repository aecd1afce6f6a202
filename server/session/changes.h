// Who changed which property of the scene last, and in which revision: what a command's base_rev is checked against.
// Pure. Render thread.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "ies/core/result.h"
#include "protocol/schema/messages.h"
#include "server/scene/light.h"

namespace gonio {

struct Scene;

// A property that a command sets, named as `gonio get` names it: "lights.key.aim", "camera", "exposure_ev100"; and the
// revision of the scene's part that holds it. Aim means orientation, also as pan, tilt and roll.
struct TouchedProperty {
    std::string path;
    Revision part_rev = 0;
};
// Result: of a command that the scene would take or has taken. Groups stand for their lights, a preset for the lights
// that it knows; load_scene touches "scene".
std::vector<TouchedProperty> touched_properties(const Scene& scene, const v1::Command& command);

// Result: whether it puts another scene in the place of this one: load_scene, open_show.
bool replaces_scene(const v1::Command& command);

inline constexpr std::size_t kMaxChanges = 4096;  // properties; beyond it all count as changed by nobody in particular

class Changes {
public:
    // revision: of the scene now; all of it counts as changed then, by nobody in particular.
    explicit Changes(Revision revision) : floor_{revision, 0} {}
    // Result: "conflict" where somebody other than `by` changed a property that the command sets, after base_rev:
    // `where` is the property, `value` the revision that changed it. "invalid_argument": base_rev is still to come.
    std::optional<Error> conflict(const Scene& scene, const v1::Command& command, Revision base_rev,
                                  std::uint32_t by) const;
    // The command was applied; `before` is the revision before it, `by` whose it was (0: a console, a fader box).
    void note(const Scene& after, Revision before, const v1::Command& command, std::uint32_t by);
    // Another scene took the place of the one before.
    void note_replaced(Revision rev, std::uint32_t by);
    // Undo set a property back.
    void note(const std::string& path, Revision rev, std::uint32_t by);

private:
    struct Change {
        Revision rev = 0;
        std::uint32_t by = 0;
    };
    void follow(const v1::RenameLight& rename);
    Change floor_;  // of what the table does not name
    std::map<std::string, Change> changes_;
};

}  // namespace gonio
