// THE table of what can be set of a light and driven by consoles and fader boxes: names, fields, units, ranges. The
// CLI's words, DMX, OSC, the surfaces' map, the saved show, what clients are told and the page's controls follow from
// it. Where the scene keeps a value is in server/scene/light_values.h.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace google::protobuf {
class Message;
}

namespace gonio {

enum class Property : std::uint8_t {
    level,
    red,
    green,
    blue,
    color,
    tint,
    cct,
    shutter,
    strobe,
    zoom,
    gobo,
    gobo_turn,
    pan,
    tilt,
    roll,
    x,
    y,
    z,
    position,
    aim,
    profile,
    gel,
    master,
    exposure,
    orbit,
    elevation,
    distance,
    preset,
    cue
};

struct PropertyRow {
    Property property;
    std::string_view name;         // of consoles and maps, "--name" of the CLI
    std::string_view field;        // of v1::SetLight and saved::Light; empty: not of a light's numbers
    std::string_view state_field;  // of v1::Light
    unsigned values = 1;           // 1 or 3; each takes one or two DMX slots
    int component = -1;            // of the field's three numbers; -1: all of them
    bool of_scene = false;         // of the scene, not of a light
    bool htp = false;              // among equal DMX senders the highest value wins, else the one that changed last
    bool has_range = true;         // whether low and high are a default; else a patch row must name its range
    double low = 0, high = 1;      // in SI units: rad, m, ratio, EV100, Duv
    double least = 0, most = 1;    // what the scene takes, likewise; a patch may not reach beyond
    bool or_none = false;          // 0 is taken too, outside of these: none
    bool whole = false;            // its values are whole numbers: the nearest one counts
    double unit = 1;               // what one of the unit that people write (docs/consoles.md: degrees) is in SI
    std::string_view unit_name;    // "°", "m"; empty: a pure number
    std::string_view metavar;      // of the CLI's option: "RATIO"
    std::string_view help;         // one phrase for people: the CLI's help, the page
    bool by_name = false;          // its value is a name: of a profile, a gel, a preset; of a cue what to do
    bool by_list = false;          // a control chooses it from the names that its row lists
    bool of_buttons = false;       // it happens, and has no value in between: a preset, a cue
    bool of_camera = false;        // orbit, elevation and distance of the eye as seen from the target
};

// Result: all of them.
std::span<const PropertyRow> property_table();
const PropertyRow& row_of(Property property);
// Result: nullptr where there is no such property.
const PropertyRow* find_property(std::string_view name);
// Result: "level, red or master": the names of the rows that `wanted` takes, in the table's order.
std::string property_names(const std::function<bool(const PropertyRow&)>& wanted);
// Result: the table for the browser page: a module that exports `properties`, an array of
// {name, field, state_field, values, component, of_scene, low, high, least, most, or_none, whole, unit, unit_name,
// help}.
std::string properties_module();

// One number, or three, of a message's field by its name: `optional double`, `double` or `repeated double`.
// Result: whether the field says something: it is present, or it holds three numbers; always for a plain `double`.
bool has_numbers(const google::protobuf::Message& message, std::string_view field);
// Result: all that the field holds: one of a scalar.
std::vector<double> read_numbers(const google::protobuf::Message& message, std::string_view field);
void write_numbers(google::protobuf::Message& message, std::string_view field, std::span<const double> numbers);
// Between messages that both have the field; says nothing where `from` says nothing.
void copy_numbers(const google::protobuf::Message& from, google::protobuf::Message& to, std::string_view field);
void clear_numbers(google::protobuf::Message& message, std::string_view field);

// A value that a console has set: what net hands to the render thread instead of knowing the scene.
struct PropertyValue {
    std::string target;  // a light or a group, or both by an OSC pattern; empty for the scene's properties
    enum class Kind : std::uint8_t { any, light, group } kind = Kind::any;
    bool pattern = false;  // `target` is an OSC pattern over encoded names
    Property property = Property::level;
    std::array<double, 3> value{};  // SI; unused ones are 0
    std::string name;  // of a property by_name; of a preset value[0] is its fade in s; of a cue "go", "back", "stop" or
                       // the number of one to go to
};

}  // namespace gonio
