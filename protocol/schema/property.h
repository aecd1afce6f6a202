// THE table of what consoles and fader boxes may drive: names, how many values, units and default ranges. DMX, OSC and
// the surfaces' map read it.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace gonio {

enum class Property : std::uint8_t {
    level,
    red,
    green,
    blue,
    color,
    pan,
    tilt,
    roll,
    x,
    y,
    z,
    position,
    aim,
    profile,
    master,
    exposure,
    orbit,
    elevation,
    distance,
    preset
};

struct PropertyRow {
    Property property;
    std::string_view name;
    unsigned values;         // 1 or 3; each takes one or two DMX slots
    bool of_scene;           // of the scene, not of a light
    bool htp;                // among equal DMX senders the highest value wins, else the one that changed last
    bool has_range;          // whether low and high are a default; else a patch row must name its range
    double low, high;        // in SI units: rad, m, ratio, EV100
    double least, most;      // what the scene takes, likewise; a patch may not reach beyond
    double unit;             // what one of the unit that people write (docs/consoles.md: degrees) is in SI
    bool by_name = false;    // its value is a name: of a profile, of a preset
    bool of_camera = false;  // orbit, elevation and distance of the eye as seen from the target
};

// Result: all of them.
std::span<const PropertyRow> property_table();
const PropertyRow& row_of(Property property);
// Result: nullptr where there is no such property.
const PropertyRow* find_property(std::string_view name);

// A value that a console has set: what net hands to the render thread instead of knowing the scene.
struct PropertyValue {
    std::string target;  // a light or a group, or both by an OSC pattern; empty for the scene's properties
    enum class Kind : std::uint8_t { any, light, group } kind = Kind::any;
    bool pattern = false;  // `target` is an OSC pattern over encoded names
    Property property = Property::level;
    std::array<double, 3> value{};  // SI; unused ones are 0
    std::string profile;            // of a property by_name: the name; a preset's value[0] is its fade in s
};

}  // namespace gonio
