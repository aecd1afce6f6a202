#include "protocol/osc/osc_space.h"

#include <cmath>
#include <span>
#include <string_view>

#include "ies/core/text.h"
#include "protocol/schema/cue.pb.h"
#include "protocol/schema/cue_number.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/state.pb.h"

namespace gonio {
namespace {

constexpr std::size_t kMaxTextBytes = 128;       // of a name among the arguments
constexpr std::size_t kShownArguments = 8;       // in a refusal
constexpr std::size_t kShownArgumentBytes = 32;  // likewise, of a string

// Views into the address.
std::vector<std::string_view> parts_of(std::string_view address) {
    std::vector<std::string_view> parts;
    for (std::size_t at = 1; at <= address.size();) {
        const std::size_t slash = std::min(address.find('/', at), address.size());
        parts.push_back(address.substr(at, slash - at));
        at = slash + 1;
    }
    return parts;
}

// Result: "Fader", 1, 50
std::string arguments_text(const OscMessage& message) {
    std::string text;
    for (std::size_t i = 0; i < message.arguments.size(); ++i) {
        if (i > 0) text += ", ";
        if (i == kShownArguments) return text + "…";
        const OscArgument& argument = message.arguments[i];
        if (const auto* words = std::get_if<std::string>(&argument))
            text += '"' + shown_text(*words, kShownArgumentBytes) + '"';
        else if (const auto* flag = std::get_if<bool>(&argument))
            text += *flag ? "true" : "false";
        else if (const auto number = osc_number(argument))
            text += print_number(*number);
        else if (const auto* blob = std::get_if<OscBlob>(&argument))
            text += "a blob of " + std::to_string(blob->size()) + " bytes";
        else
            text += std::holds_alternative<OscNil>(argument) ? "nil" : "impulse";
    }
    return text;
}

// The sender hears the message alone, so it names all that came: grandMA3 puts a name and a number before its value.
Error wrong_argument(const OscMessage& message, std::string value, const std::string& wanted) {
    const std::string came = message.arguments.empty() ? "" : "; it came with (" + arguments_text(message) + ")";
    return {"invalid_argument", message.address, std::move(value), wanted + came};
}

// Result: whether a button that sends this was pressed: 0 is its release, no argument a press.
Result<bool> pressed(const OscMessage& message) {
    if (message.arguments.empty()) return true;
    const auto number = osc_number(message.arguments[0]);
    if (!number) return wrong_argument(message, "argument 1", "must be a number: 0 is the button's release");
    return *number != 0;
}

// what: as PropertyValue::name of a cue.
Result<OscAction> cue_action(const OscMessage& message, std::string what) {
    const auto fires = pressed(message);
    if (!fires) return fires.error();
    if (!*fires) return OscAction(OscNothing{});
    PropertyValue value;
    value.property = Property::cue;
    value.name = std::move(what);
    return OscAction(OscSet{std::move(value)});
}

Error no_such_address(const OscMessage& message) {
    return {"not_found", message.address, "", "there is no such address"};
}

// Below /gonio/cue: go, back, stop, N/fire.
Result<OscAction> cue_address(const OscMessage& message, std::span<const std::string_view> parts) {
    if (parts.size() == 1)
        for (const char* what : {"go", "back", "stop"})
            if (parts[0] == what) return cue_action(message, what);
    if (parts.size() == 2 && parts[1] == "fire" && parse_cue_number(parts[0]))
        return cue_action(message, std::string(parts[0]));
    return no_such_address(message);
}

// Below /eos: what consoles and controllers of Eos send (ETC, "Open Sound Control", Eos OSC dictionary). There is one
// list of cues, whatever list they name.
Result<OscAction> eos_address(const OscMessage& message, std::span<const std::string_view> parts) {
    const auto is = [&](std::size_t at, std::string_view part) { return at < parts.size() && parts[at] == part; };
    if (parts.size() == 1 && is(0, "ping")) return OscAction(OscPing{"/eos/out/ping"});
    if (parts.size() == 1 && is(0, "subscribe")) {
        const auto wants = pressed(message);
        if (!wants) return wants.error();
        return *wants ? OscAction(OscSubscribe{}) : OscAction(OscUnsubscribe{});
    }
    if (parts.size() == 2 && is(0, "key")) {
        if (is(1, "go_0") || is(1, "go")) return cue_action(message, "go");
        if (is(1, "stop")) return cue_action(message, "stop");
    }
    const std::size_t last = parts.size() - 1;
    if ((parts.size() == 3 || parts.size() == 4) && is(0, "cue") && is(last, "fire") &&
        parse_cue_number(parts[last - 1]))
        return cue_action(message, std::string(parts[last - 1]));
    return no_such_address(message);
}

Result<OscAction> service(const OscMessage& message, std::string_view name) {
    if (name == "ping") return OscAction(OscPing{});
    if (name == "unsubscribe") return OscAction(OscUnsubscribe{});
    if (name != "subscribe") return Error{"not_found", message.address, "", "there is no such address"};
    if (message.arguments.empty()) return OscAction(OscSubscribe{});
    const auto port = osc_number(message.arguments[0]);
    if (!port || !(*port >= 1 && *port <= 65535) || *port != std::floor(*port))
        return wrong_argument(message, port ? print_number(*port) : "", "the port must be a number from 1 to 65535");
    return OscAction(OscSubscribe{static_cast<std::uint16_t>(*port)});
}

Result<PropertyValue> value_of(const OscMessage& message, const PropertyRow& property, PropertyValue value) {
    value.property = property.property;
    if (property.by_name) {
        const auto* name = std::get_if<std::string>(&message.arguments[0]);
        if (name == nullptr)
            return wrong_argument(message, "",
                                  property.property == Property::preset
                                      ? "a preset is a string: its name, and the fade in seconds after it"
                                  : property.property == Property::gel ? "a gel is a string: its name, empty for none"
                                  : property.property == Property::cue
                                      ? "a cue is a string: go, back, stop, or the number of one"
                                      : "a profile is a string: the name of a built-in luminaire");
        if (name->size() > kMaxTextBytes)
            return wrong_argument(message, shown_text(*name), "a name has at most 128 bytes");
        value.name = *name;
        if (property.property == Property::preset && message.arguments.size() > 1) {
            const auto fade_s = osc_number(message.arguments[1]);
            if (!fade_s) return wrong_argument(message, "argument 2", "must be a number: the fade in seconds");
            value.value[0] = *fade_s;
        }
        return value;
    }
    if (message.arguments.size() < property.values)
        return wrong_argument(message, std::to_string(message.arguments.size()) + " arguments",
                              "needs " + std::to_string(property.values) + " numbers");
    for (unsigned i = 0; i < property.values; ++i) {
        const auto number = osc_number(message.arguments[i]);
        if (!number) return wrong_argument(message, "argument " + std::to_string(i + 1), "must be a number");
        value.value[i] = *number * property.unit;
    }
    return value;
}

// Result: the message's value for each property that `part` names. Where it is a pattern those are left out that do not
// take the arguments.
Result<OscAction> set_values(const OscMessage& message, std::string_view part, const PropertyValue& value) {
    const bool of_scene = value.target.empty(), pattern = is_osc_pattern(part);
    OscSet set;
    Error why{"not_found", message.address, "", "there is no such address"};
    for (const PropertyRow& property : property_table()) {
        if (property.of_scene != of_scene || !osc_matches(part, property.name)) continue;
        auto one = value_of(message, property, value);
        if (one)
            set.push_back(std::move(*one));
        else if (set.empty() && why.code == "not_found")
            why = one.error();
        if (!one && !pattern) return one.error();
    }
    if (set.empty()) return why;
    return OscAction(std::move(set));
}

OscArgument real(double value) {
    return static_cast<float>(value);
}

}  // namespace

Result<OscAction> osc_action(const OscMessage& message, bool eos) {
    const std::vector<std::string_view> parts = parts_of(message.address);
    if (parts.size() > 2 && parts[0] == "gonio" && parts[1] == "cue")
        return cue_address(message, std::span(parts).subspan(2));
    if (eos && parts.size() > 1 && parts[0] == "eos") return eos_address(message, std::span(parts).subspan(1));
    if (parts.size() == 2 && parts[0] == "gonio") return service(message, parts[1]);
    if (message.arguments.empty()) return OscAction(OscQuery{});
    if (parts.size() == 1) return set_values(message, parts[0], {});
    PropertyValue value;
    const bool of_light = parts.size() == 3 && osc_matches(parts[0], "light");
    const bool of_group = parts.size() == 3 && osc_matches(parts[0], "group");
    if (!of_light && !of_group) return Error{"not_found", message.address, "", "there is no such address"};
    if (of_light != of_group) value.kind = of_light ? PropertyValue::Kind::light : PropertyValue::Kind::group;
    value.pattern = is_osc_pattern(parts[1]);
    value.target = value.pattern ? std::string(parts[1]) : decode_osc_name(parts[1]);
    if (value.target.empty()) return Error{"not_found", message.address, "", "there is no such address"};
    return set_values(message, parts[2], value);
}

static void put_light(OscValues& values, const std::string& root, const v1::Light& light) {
    for (const PropertyRow& row : property_table()) {
        if (row.state_field.empty()) continue;
        const std::vector<double> numbers = read_numbers(light, row.state_field);
        if (row.component >= 0 && numbers.size() != 3) continue;
        std::vector<OscArgument>& told = values[root + std::string(row.name)];
        for (std::size_t i = 0; i < numbers.size(); ++i)
            if (row.component < 0 || i == static_cast<std::size_t>(row.component))
                told.push_back(real(numbers[i] / row.unit));
    }
    values[root + "profile"] = {light.profile()};
    values[root + "gel"] = {light.gel()};
}

OscValues osc_values(const v1::State& state) {
    OscValues values;
    std::map<std::string_view, const v1::Light*> lights;
    for (const v1::Light& light : state.lights()) {
        lights[light.name()] = &light;
        put_light(values, "/light/" + encode_osc_name(light.name()) + "/", light);
    }
    for (const v1::Group& group : state.groups()) {
        const auto first = group.lights_size() > 0 ? lights.find(group.lights(0)) : lights.end();
        if (first != lights.end()) put_light(values, "/group/" + encode_osc_name(group.name()) + "/", *first->second);
    }
    values["/master"] = {real(state.master_ratio())};
    values["/exposure"] = {real(state.exposure_ev100())};
    values["/cue/active"] = {state.cue_playback().active()};
    values["/cue/next"] = {state.cue_playback().next()};
    values["/cue/progress"] = {real(state.cue_playback().progress_ratio())};
    return values;
}

OscValues eos_values(const v1::State& state) {
    OscValues values;
    const v1::CuePlayback& playback = state.cue_playback();
    const auto text = [&](const std::string& number) {
        std::string label = number;
        for (const v1::Cue& cue : state.cues().cues())
            if (cue.number() == number && !cue.label().empty()) label += " " + cue.label();
        return label;
    };
    const std::string active = "/eos/out/active/cue/", pending = "/eos/out/pending/cue/";
    if (!playback.active().empty()) values[active + "1/" + playback.active()] = {real(playback.progress_ratio())};
    if (!playback.next().empty()) values[pending + "1/" + playback.next()] = {};
    values[active + "text"] = {text(playback.active())};
    values[pending + "text"] = {text(playback.next())};
    return values;
}

Result<OscValues> osc_select(const OscValues& values, const std::string& pattern, std::size_t& budget) {
    OscValues selected;
    if (!is_osc_pattern(pattern)) {
        if (const auto found = values.find(pattern); found != values.end()) selected.insert(*found);
        return selected;
    }
    const std::vector<std::string_view> wanted = parts_of(pattern);
    std::vector<std::map<std::string_view, bool>> known(wanted.size());  // of each part: names that were compared
    for (const auto& [address, arguments] : values) {
        const std::vector<std::string_view> parts = parts_of(address);
        bool matches = parts.size() == wanted.size();
        for (std::size_t i = 0; matches && i < parts.size(); ++i) {
            auto found = known[i].find(parts[i]);
            if (found == known[i].end()) {
                if (budget < wanted[i].size())
                    return Error{"too_large", pattern, "", "the patterns of one packet compare too much"};
                budget -= wanted[i].size();
                found = known[i].emplace(parts[i], osc_matches(wanted[i], parts[i])).first;
            }
            matches = found->second;
        }
        if (matches) selected.emplace(address, arguments);
    }
    return selected;
}

}  // namespace gonio
