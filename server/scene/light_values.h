// Where the scene keeps the numbers of a light, and what each makes stale: the scene's side of the table of properties
// (protocol/schema/property.h). Commands, presets and their fades, consoles, the saved show and what clients are told
// go through it.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

#include "protocol/schema/property.h"
#include "server/scene/light.h"

namespace gonio {

struct Scene;

struct LightRow {
    Property property;                           // of a whole field: color, not red
    double LightValues::*number = nullptr;       // one of the two
    glm::dvec3 LightValues::*vector = nullptr;   // likewise
    Revision Light::*stale = &Light::level_rev;  // the part of the light that a change makes stale
};

// Result: all of them, in the order in which they are told of. The orientation is kept as pan, tilt and roll; an aim is
// turned into those.
std::span<const LightRow> light_rows();
// Result: the row of a property or of the whole that it is a component of; nullptr where a light has no such number.
const LightRow* light_row_of(Property property);

// A number, or three: SI. Unused ones are 0.
using Numbers = std::array<double, 3>;
Numbers numbers_of(const LightValues& light, const LightRow& light_row);
void set_numbers(LightValues& light, const LightRow& light_row, const Numbers& numbers);
// Result: how many of them count: 1 or 3.
std::size_t count_of(const LightRow& light_row);
// Writes them into a message's field of the row.
void write_numbers(google::protobuf::Message& message, std::string_view field, const LightRow& light_row,
                   const Numbers& numbers);

// Result: the light of this name, or nullptr.
template <typename AnyScene>  // Scene or const Scene
auto find_light(AnyScene& scene, const std::string& name) -> decltype(scene.lights.data()) {
    const auto at = std::ranges::find(scene.lights, name, &Light::name);
    return at == scene.lights.end() ? nullptr : &*at;
}
// Result: whether a light or a group has this name.
bool is_taken(const Scene& scene, const std::string& name);
// Result: the newest revision of a light's place, aim, profile, level, colour or white.
inline Revision newest_rev(const Light& light) {
    return std::max({light.position_rev, light.aim_rev, light.profile_rev, light.level_rev});
}

}  // namespace gonio
