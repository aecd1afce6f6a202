// An edit: one property of the scene, with its value before and after a command. What undo remembers, and what apply()
// takes to set it back. Pure.
#pragma once

#include <algorithm>
#include <compare>
#include <cstdint>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "protocol/schema/messages.h"
#include "server/scene/cue.h"
#include "server/scene/haze.h"
#include "server/scene/light.h"
#include "server/scene/light_values.h"

namespace gonio {

struct Scene;

// In the order in which apply() sets them back: groups name lights that must be there.
enum class EditKind : std::uint8_t {
    light,  // whether it is there
    name,
    aim,      // the orientation, also as pan, tilt and roll
    numbers,  // any other row of light_rows()
    profile,
    gel,
    opening,
    group,
    preset,
    cue,
    recalled,  // Scene::recalled
    patch,
    surfaces,
    grid,
    observer,
    haze,
    master,
    view_light,  // changes with a light that goes or comes back
};

struct EditKey {
    EditKind kind = EditKind::light;
    std::uint32_t light = 0;                 // Light::id, of the first seven
    Property property = Property::position;  // of numbers
    std::string name;                        // of a group, preset, grid or observer
    CueNumber cue = 0;
    auto operator<=>(const EditKey&) const = default;
};
inline bool is_of_light(const EditKey& key) {
    return key.kind <= EditKind::opening;
}

struct ExistingLight {
    std::shared_ptr<const Light> light;  // as it was; its parts have edits of their own
    bool operator==(const ExistingLight&) const { return true; }
};
struct Orientation {
    glm::dquat world_from_light{1.0, 0.0, 0.0, 0.0};
    double pan_rad = 0, tilt_rad = 0, roll_rad = 0;
    bool operator==(const Orientation&) const = default;
};
using LightIds = std::vector<std::uint32_t>;  // of a group, in its order: a light that is renamed stays in it
// monostate: there is no such light, group, preset, cue, grid or observer. Presets, cues, patch, surfaces, grids and
// observers are equal where they are the same.
using EditValue =
    std::variant<std::monostate, ExistingLight, std::string, Orientation, Numbers, std::shared_ptr<const Profile>,
                 std::shared_ptr<const Gel>, LightIds, std::shared_ptr<const Preset>, std::shared_ptr<const Cue>,
                 std::shared_ptr<const v1::SetPatch>, std::shared_ptr<const v1::SetSurfaces>,
                 std::shared_ptr<const v1::Grid>, std::shared_ptr<const v1::Observer>, std::optional<ies::Opening>,
                 HazeValues, double, std::uint32_t>;

struct Edit {
    EditKey key;
    EditValue before, after;
};
struct EditTarget {
    EditKey key;
    EditValue value;
};

// Result: what the property is now.
EditValue value_of(const Scene& scene, const EditKey& key);
// Result: aim, numbers, profile, gel and opening of a light or of what a preset keeps of it; monostate of another kind.
EditValue value_of(const LightValues& light, const EditKey& key);
// Result: the keys of all that value_of() knows of a light, and of its name.
std::vector<EditKey> keys_of(std::uint32_t light);
// Result: the light of this id, or nullptr. O(log lights).
template <typename AnyScene>  // Scene or const Scene
auto light_of(AnyScene& scene, std::uint32_t id) -> decltype(scene.lights.data()) {
    const auto at = std::ranges::lower_bound(scene.lights, id, {}, &Light::id);
    return at == scene.lights.end() || at->id != id ? nullptr : &*at;
}
// Result: what differs, of what undo knows, in the order of the keys; the later scene came from the earlier one. Takes
// O(what differs), and a look at the revisions of each light: 4 µs of 1,024, beside 90 µs of apply().
std::vector<Edit> edits_between(const Scene& before, const Scene& after);
// Result: what a fade from the scene to the preset will change when it ends.
std::vector<Edit> edits_of_fade(const Scene& scene, const Preset& to);
// Result: "level of 'key'", "group 'wash'", "the patch", for people.
std::string words_of(const Scene& scene, const EditKey& key);
// Result: as `gonio get` and Changes name it: "lights.key.level_ratio"; empty where they do not.
std::string path_of(const Scene& scene, const EditKey& key);

}  // namespace gonio
