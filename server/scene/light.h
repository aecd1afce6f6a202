// A light of the running scene, and its values that presets keep.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/scene/gel.h"
#include "server/scene/profile.h"

namespace gonio {

using Revision = std::uint32_t;

// The values of a light that commands set and presets keep. light_values.h has them as a table.
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

// How a light's zoom and gobo change its profile: shaped_profile.h.
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
    // The frame in which pan, tilt and roll are measured: the light's orientation is world_from_mount times
    // orientation_of(pan, tilt, roll). The identity, except for an imported moving head.
    glm::dquat world_from_mount{1.0, 0.0, 0.0, 0.0};
    std::shared_ptr<const Profile> shaped;  // of `shaped_of`, which follows zoom and gobo; null: the profile as it is
    std::pair<std::shared_ptr<const Profile>, Shaping> shaped_of;
    bool flash_off = false;  // of its strobe, now (strobe.h)
    bool missing = false;    // its fixture is not in the MVR show that was merged last: it is dark
    int imported = -1;       // index into Imported::lights of Scene::imported; -1: it is none of an MVR show
    // Result: the profile that it shines with.
    const std::shared_ptr<const Profile>& shining() const { return shaped ? shaped : profile; }
    double tilt_factor = 1.0;  // LM-63 TILT=INCLUDE: all candela at the luminaire's tilt; follows aim and profile
    Revision position_rev = 0, aim_rev = 0, profile_rev = 0, level_rev = 0, name_rev = 0;
};

struct PresetLight : LightValues {
    std::string name;
};
using Preset = std::vector<PresetLight>;

}  // namespace gonio
