#include "protocol/osc_space.h"

#include <cmath>
#include <numbers>

namespace gonio {
namespace {

std::vector<std::string> parts_of(const std::string& address) {
    std::vector<std::string> parts;
    for (std::size_t at = 1; at <= address.size();) {
        const std::size_t slash = std::min(address.find('/', at), address.size());
        parts.push_back(address.substr(at, slash - at));
        at = slash + 1;
    }
    return parts;
}

Error wrong_argument(const OscMessage& message, std::string value, std::string wanted) {
    return {"invalid_argument", message.address, std::move(value), std::move(wanted)};
}

Result<OscAction> service(const OscMessage& message, const std::string& name) {
    if (name == "ping") return OscAction(OscPing{});
    if (name == "unsubscribe") return OscAction(OscUnsubscribe{});
    if (name != "subscribe") return Error{"not_found", message.address, "", "there is no such address"};
    if (message.arguments.empty()) return OscAction(OscSubscribe{});
    const auto port = osc_number(message.arguments[0]);
    if (!port || !(*port >= 1 && *port <= 65535) || *port != std::floor(*port))
        return wrong_argument(message, port ? print_number(*port) : "", "the port must be a number from 1 to 65535");
    return OscAction(OscSubscribe{static_cast<std::uint16_t>(*port)});
}

Result<OscAction> set_value(const OscMessage& message, const PropertyRow& property, PropertyValue value) {
    value.property = property.property;
    if (message.arguments.empty()) return OscAction(OscQuery{});
    if (property.by_name) {
        const auto* name = std::get_if<std::string>(&message.arguments[0]);
        if (name == nullptr)
            return wrong_argument(message, "",
                                  property.property == Property::preset
                                      ? "a preset is a string: its name, and the fade in seconds after it"
                                      : "a profile is a string: the name of a built-in luminaire");
        value.profile = *name;
        if (property.property == Property::preset && message.arguments.size() > 1)
            value.value[0] = osc_number(message.arguments[1]).value_or(0.0);
        return OscAction(std::move(value));
    }
    if (message.arguments.size() < property.values)
        return wrong_argument(message, std::to_string(message.arguments.size()) + " arguments",
                              "needs " + std::to_string(property.values) + " numbers");
    for (unsigned i = 0; i < property.values; ++i) {
        const auto number = osc_number(message.arguments[i]);
        if (!number) return wrong_argument(message, "argument " + std::to_string(i + 1), "must be a number");
        value.value[i] = *number * property.unit;
    }
    return OscAction(std::move(value));
}

OscArgument real(double value) {
    return static_cast<float>(value);
}

std::vector<OscArgument> vector_of(const google::protobuf::RepeatedField<double>& field) {
    std::vector<OscArgument> arguments;
    for (const double value : field) arguments.push_back(real(value));
    return arguments;
}

}  // namespace

Result<OscAction> osc_action(const OscMessage& message) {
    const std::vector<std::string> parts = parts_of(message.address);
    const Error nowhere{"not_found", message.address, "", "there is no such address"};
    if (parts.size() == 2 && parts[0] == "gonio") return service(message, parts[1]);
    if (parts.size() == 1) {
        const PropertyRow* property = find_property(parts[0]);
        if (property == nullptr || !property->of_scene) return nowhere;
        return set_value(message, *property, {});
    }
    if (parts.size() != 3) return nowhere;
    PropertyValue value;
    if (parts[0] == "light")
        value.kind = PropertyValue::Kind::light;
    else if (parts[0] == "group")
        value.kind = PropertyValue::Kind::group;
    else if (!is_osc_pattern(parts[0]))
        return nowhere;
    else if (osc_matches(parts[0], "light") == osc_matches(parts[0], "group"))
        value.kind = PropertyValue::Kind::any;
    else
        value.kind = osc_matches(parts[0], "light") ? PropertyValue::Kind::light : PropertyValue::Kind::group;
    if (is_osc_pattern(parts[0]) && !osc_matches(parts[0], "light") && !osc_matches(parts[0], "group")) return nowhere;
    value.pattern = is_osc_pattern(parts[1]);
    value.target = value.pattern ? parts[1] : decode_osc_name(parts[1]);
    if (message.arguments.empty()) return OscAction(OscQuery{});
    const PropertyRow* property = find_property(parts[2]);
    if (property == nullptr || property->of_scene) return nowhere;
    return set_value(message, *property, std::move(value));
}

OscValues osc_values(const v1::State& state) {
    constexpr double kDegrees = 180.0 / std::numbers::pi;
    OscValues values;
    for (const v1::Light& light : state.lights()) {
        const std::string root = "/light/" + encode_osc_name(light.name()) + "/";
        values[root + "level"] = {real(light.level_ratio())};
        values[root + "color"] = vector_of(light.color_rgb());
        values[root + "pan"] = {real(light.pan_rad() * kDegrees)};
        values[root + "tilt"] = {real(light.tilt_rad() * kDegrees)};
        values[root + "roll"] = {real(light.roll_rad() * kDegrees)};
        values[root + "position"] = vector_of(light.position());
        values[root + "aim"] = vector_of(light.aim());
        values[root + "profile"] = {light.profile()};
        static constexpr const char* kColors[] = {"red", "green", "blue"};
        static constexpr const char* kAxes[] = {"x", "y", "z"};
        for (int i = 0; i < 3 && light.color_rgb_size() == 3 && light.position_size() == 3; ++i) {
            values[root + kColors[i]] = {real(light.color_rgb(i))};
            values[root + kAxes[i]] = {real(light.position(i))};
        }
    }
    values["/master"] = {real(state.master_ratio())};
    values["/exposure"] = {real(state.exposure_ev100())};
    return values;
}

OscValues osc_select(const OscValues& values, const std::string& pattern) {
    OscValues selected;
    if (!is_osc_pattern(pattern)) {
        if (const auto found = values.find(pattern); found != values.end()) selected.insert(*found);
        return selected;
    }
    const std::vector<std::string> wanted = parts_of(pattern);
    for (const auto& [address, arguments] : values) {
        const std::vector<std::string> parts = parts_of(address);
        bool matches = parts.size() == wanted.size();
        for (std::size_t i = 0; matches && i < parts.size(); ++i) matches = osc_matches(wanted[i], parts[i]);
        if (matches) selected.emplace(address, arguments);
    }
    return selected;
}

}  // namespace gonio
