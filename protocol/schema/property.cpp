#include "protocol/schema/property.h"

#include <google/protobuf/message.h>
#include <google/protobuf/reflection.h>

#include <iterator>
#include <numbers>

#include "ies/core/result.h"

namespace gonio {

static constexpr double kPi = std::numbers::pi;
static constexpr double kDegree = kPi / 180.0;
static constexpr double kTurns = 64 * kPi;  // farther turns are refused
static constexpr double kFar_m = 1e6;       // farther positions are refused
static constexpr double kMostFactor = 1e4;  // of a colour
static constexpr double kMostDuv = 0.05;    // beyond it Rec.709 factors of D65 become negative

// In the order of the enum. Pan and tilt: the usual travel of moving heads, 540 and 270 degrees.
// clang-format off
static constexpr PropertyRow kTable[] = {
    {.property = Property::level, .name = "level", .field = "level_ratio", .state_field = "level_ratio", .htp = true,
     .metavar = "RATIO", .help = "share of its flux"},
    {.property = Property::red, .name = "red", .field = "color_rgb", .state_field = "color_rgb", .component = 0,
     .most = kMostFactor, .help = "factor of red"},
    {.property = Property::green, .name = "green", .field = "color_rgb", .state_field = "color_rgb", .component = 1,
     .most = kMostFactor, .help = "factor of green"},
    {.property = Property::blue, .name = "blue", .field = "color_rgb", .state_field = "color_rgb", .component = 2,
     .most = kMostFactor, .help = "factor of blue"},
    {.property = Property::color, .name = "color", .field = "color_rgb", .state_field = "color_rgb", .values = 3,
     .most = kMostFactor, .metavar = "r,g,b", .help = "factors of linear Rec.709"},
    {.property = Property::tint, .name = "tint", .field = "tint_duv", .state_field = "tint_duv", .low = -kMostDuv,
     .high = kMostDuv, .least = -kMostDuv, .most = kMostDuv, .unit_name = "Duv",
     .metavar = "DUV", .help = "from magenta to green, at the same lux"},
    // 1,000 to 15,000 K: of the formula (server/scene/white.h). Consoles: what LED luminaires have, and a little more.
    {.property = Property::cct, .name = "cct", .field = "cct_k", .state_field = "cct_k", .low = 2000, .high = 10'000,
     .least = 1000, .most = 15'000, .or_none = true, .unit_name = "K", .metavar = "K",
     .help = "correlated colour temperature, at the same lux"},
    {.property = Property::shutter, .name = "shutter", .field = "shutter_ratio", .state_field = "shutter_ratio",
     .metavar = "RATIO", .help = "share of its light that passes"},
    {.property = Property::strobe, .name = "strobe", .field = "strobe_hz", .state_field = "strobe_hz", .high = 25,
     .most = 50, .unit_name = "Hz", .metavar = "HZ", .help = "flashes, on for half of the time"},
    {.property = Property::zoom, .name = "zoom", .field = "zoom_rad", .state_field = "zoom_rad", .low = 5 * kDegree,
     .high = 60 * kDegree, .least = 0.1 * kDegree, .most = 175 * kDegree, .or_none = true, .unit = kDegree,
     .unit_name = "°", .metavar = "DEG", .help = "full angle of half the peak, at the same flux"},
    {.property = Property::gobo, .name = "gobo", .field = "gobo", .state_field = "gobo", .high = 255, .most = 255,
     .whole = true, .metavar = "NUMBER", .help = "slot of its wheel, 0: open"},
    {.property = Property::gobo_turn, .name = "gobo-turn", .field = "gobo_rad", .state_field = "gobo_rad", .low = -kPi,
     .high = kPi, .least = -kTurns, .most = kTurns, .unit = kDegree, .unit_name = "°", .metavar = "DEG",
     .help = "turn of the gobo"},
    {.property = Property::pan, .name = "pan", .field = "pan_rad", .state_field = "pan_rad", .low = -1.5 * kPi,
     .high = 1.5 * kPi, .least = -kTurns, .most = kTurns, .unit = kDegree, .unit_name = "°", .metavar = "DEG",
     .help = "turn about the vertical"},
    {.property = Property::tilt, .name = "tilt", .field = "tilt_rad", .state_field = "tilt_rad", .low = -0.75 * kPi,
     .high = 0.75 * kPi, .least = -kTurns, .most = kTurns, .unit = kDegree, .unit_name = "°", .metavar = "DEG",
     .help = "from straight down"},
    {.property = Property::roll, .name = "roll", .field = "roll_rad", .state_field = "roll_rad", .low = -kPi,
     .high = kPi, .least = -kTurns, .most = kTurns, .unit = kDegree, .unit_name = "°", .metavar = "DEG",
     .help = "about its own axis"},
    {.property = Property::x, .name = "x", .field = "position_m", .state_field = "position", .component = 0,
     .has_range = false, .low = 0, .high = 0, .least = -kFar_m, .most = kFar_m, .unit_name = "m"},
    {.property = Property::y, .name = "y", .field = "position_m", .state_field = "position", .component = 1,
     .has_range = false, .low = 0, .high = 0, .least = -kFar_m, .most = kFar_m, .unit_name = "m"},
    {.property = Property::z, .name = "z", .field = "position_m", .state_field = "position", .component = 2,
     .has_range = false, .low = 0, .high = 0, .least = -kFar_m, .most = kFar_m, .unit_name = "m"},
    {.property = Property::position, .name = "position", .field = "position_m", .state_field = "position", .values = 3,
     .has_range = false, .low = 0, .high = 0, .least = -kFar_m, .most = kFar_m, .unit_name = "m", .metavar = "x,y,z",
     .help = "world"},
    {.property = Property::aim, .name = "aim", .field = "aim", .state_field = "aim", .values = 3, .low = -1,
     .least = -kFar_m, .most = kFar_m, .metavar = "x,y,z",
     .help = "direction of any length but 0, instead of pan, tilt and roll"},
    {.property = Property::profile, .name = "profile", .by_name = true, .by_list = true},
    {.property = Property::gel, .name = "gel", .by_name = true, .by_list = true},
    {.property = Property::master, .name = "master", .of_scene = true, .htp = true},
    {.property = Property::exposure, .name = "exposure", .of_scene = true, .high = 15, .least = -10, .most = 24,
     .unit_name = "EV100"},
    // Azimuth from +Z towards +X, height above the horizontal, metres. Straight up and down the camera has no azimuth.
    {.property = Property::orbit, .name = "orbit", .of_scene = true, .low = -kPi, .high = kPi, .least = -kTurns,
     .most = kTurns, .unit = kDegree, .unit_name = "°", .of_camera = true},
    {.property = Property::elevation, .name = "elevation", .of_scene = true, .low = -kPi / 3, .high = kPi / 3,
     .least = -89 * kDegree, .most = 89 * kDegree, .unit = kDegree, .unit_name = "°", .of_camera = true},
    {.property = Property::distance, .name = "distance", .of_scene = true, .has_range = false, .low = 0, .high = 0,
     .least = 1e-3, .most = kFar_m, .unit_name = "m", .of_camera = true},
    {.property = Property::preset, .name = "preset", .of_scene = true, .by_name = true, .of_buttons = true},
    {.property = Property::cue, .name = "cue", .of_scene = true, .by_name = true, .of_buttons = true},
};
// clang-format on
static_assert(std::size(kTable) == static_cast<std::size_t>(Property::cue) + 1);

std::span<const PropertyRow> property_table() {
    return kTable;
}

const PropertyRow& row_of(Property property) {
    return kTable[static_cast<std::size_t>(property)];
}

const PropertyRow* find_property(std::string_view name) {
    for (const PropertyRow& row : kTable)
        if (row.name == name) return &row;
    return nullptr;
}

std::string property_names(const std::function<bool(const PropertyRow&)>& wanted) {
    std::vector<std::string_view> names;
    for (const PropertyRow& row : kTable)
        if (wanted(row)) names.push_back(row.name);
    std::string text;
    for (std::size_t i = 0; i < names.size(); ++i)
        text.append(i == 0 ? "" : i + 1 < names.size() ? ", " : " or ").append(names[i]);
    return text;
}

std::string properties_module() {
    std::string text =
        "// What can be set of a light and driven by consoles and fader boxes; numbers are SI.\n"
        "export const properties = [\n";
    const auto put = [&](std::string_view key, const std::string& value) {
        text.append(key).append(": ").append(value).append(", ");
    };
    const auto quoted = [](std::string_view value) { return "\"" + std::string(value) + "\""; };
    for (const PropertyRow& row : kTable) {
        text += "    {";
        put("name", quoted(row.name));
        put("field", quoted(row.field));
        put("state_field", quoted(row.state_field));
        put("values", std::to_string(row.values));
        put("component", std::to_string(row.component));
        put("of_scene", row.of_scene ? "true" : "false");
        put("by_name", row.by_name ? "true" : "false");
        put("has_range", row.has_range ? "true" : "false");
        put("low", print_number(row.low));
        put("high", print_number(row.high));
        put("least", print_number(row.least));
        put("most", print_number(row.most));
        put("or_none", row.or_none ? "true" : "false");
        put("whole", row.whole ? "true" : "false");
        put("unit", print_number(row.unit));
        put("unit_name", quoted(row.unit_name));
        put("help", quoted(row.help));
        text += "},\n";
    }
    return text + "];\n";
}

namespace {

struct Field {
    const google::protobuf::Reflection* reflection;
    const google::protobuf::FieldDescriptor* descriptor;
};

// Asked for each property of each light that moves, in every frame: comparing a dozen names is faster than
// FindFieldByName, which hashes.
Field field_of(const google::protobuf::Message& message, std::string_view name) {
    const google::protobuf::Descriptor& fields = *message.GetDescriptor();
    int i = 0;
    while (fields.field(i)->name() != name) ++i;
    return {message.GetReflection(), fields.field(i)};
}

}  // namespace

bool has_numbers(const google::protobuf::Message& message, std::string_view field) {
    const auto [reflection, at] = field_of(message, field);
    if (at->is_repeated()) return reflection->FieldSize(message, at) > 0;
    return !at->has_presence() || reflection->HasField(message, at);
}

std::vector<double> read_numbers(const google::protobuf::Message& message, std::string_view field) {
    const auto [reflection, at] = field_of(message, field);
    if (!at->is_repeated()) return {reflection->GetDouble(message, at)};
    const auto numbers = reflection->GetRepeatedFieldRef<double>(message, at);
    return {numbers.begin(), numbers.end()};
}

void write_numbers(google::protobuf::Message& message, std::string_view field, std::span<const double> numbers) {
    const auto [reflection, at] = field_of(message, field);
    // + 0.0: never -0, which counts as no change of 0 but is another text.
    if (!at->is_repeated()) return reflection->SetDouble(&message, at, numbers[0] + 0.0);
    const auto elements = reflection->GetMutableRepeatedFieldRef<double>(&message, at);
    elements.Clear();
    for (const double number : numbers) elements.Add(number + 0.0);
}

void copy_numbers(const google::protobuf::Message& from, google::protobuf::Message& to, std::string_view field) {
    if (has_numbers(from, field)) write_numbers(to, field, read_numbers(from, field));
}

void clear_numbers(google::protobuf::Message& message, std::string_view field) {
    const auto [reflection, at] = field_of(message, field);
    reflection->ClearField(&message, at);
}

}  // namespace gonio
