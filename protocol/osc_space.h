// What OSC addresses mean here (docs/consoles.md has the table), and the state as OSC messages. Pure.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "ies/result.h"
#include "protocol/gonio.pb.h"
#include "protocol/osc.h"
#include "protocol/property.h"

namespace gonio {

struct OscQuery {};  // an address without arguments: tell me its value
struct OscSubscribe {
    std::optional<std::uint16_t> port;  // where to send to; absent: where the message came from
};
struct OscUnsubscribe {};
struct OscPing {};
using OscAction = std::variant<PropertyValue, OscQuery, OscSubscribe, OscUnsubscribe, OscPing>;

// Result: what the message asks for; angles in degrees become radians. Errors: "not_found" (no such address),
// "invalid_argument" (too few arguments, or of the wrong type); `where` is the address.
Result<OscAction> osc_action(const OscMessage& message);

// Address -> arguments of everything the state says: what queries read and subscribers hear.
using OscValues = std::map<std::string, std::vector<OscArgument>>;
// Result: all values of a full State.
OscValues osc_values(const v1::State& state);
// Result: those whose address the pattern matches, part by part.
OscValues osc_select(const OscValues& values, const std::string& pattern);

}  // namespace gonio
