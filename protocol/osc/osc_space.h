// What OSC addresses mean here (docs/consoles.md has the table), and the state as OSC messages. Pure.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "ies/core/result.h"
#include "protocol/osc/osc.h"
#include "protocol/schema/messages.h"
#include "protocol/schema/property.h"

namespace gonio {

struct OscQuery {};  // an address without arguments: tell me its value
struct OscSubscribe {
    std::optional<std::uint16_t> port;  // where to send to; absent: where the message came from
};
struct OscUnsubscribe {};
struct OscPing {
    const char* pong = "/gonio/pong";
};
struct OscNothing {};  // understood, and nothing is to do: a button was let go
// Of a pattern in the last part: one value for each property that matches it and takes these arguments.
using OscSet = std::vector<PropertyValue>;
using OscAction = std::variant<OscSet, OscQuery, OscSubscribe, OscUnsubscribe, OscPing, OscNothing>;

// Result: what the message asks for, at least one value to set; angles in degrees become radians. Errors: "not_found"
// (no such address), "invalid_argument" (too few arguments, of the wrong type, a name over 128 bytes); `where` is the
// address. Whether an address that asks has values is osc_select()'s to say. eos: addresses of Eos are understood too.
Result<OscAction> osc_action(const OscMessage& message, bool eos = false);

// Address -> arguments of everything the state says: what queries read and subscribers hear.
using OscValues = std::map<std::string, std::vector<OscArgument>>;
// Result: all values of a full State. Those of a group are its first light's.
OscValues osc_values(const v1::State& state);
// Result: what Eos tells of its cues: the active one with its progress and its text, and the pending one.
OscValues eos_values(const v1::State& state);
inline constexpr std::size_t kOscPatternBudget = 1u
                                                 << 17;  // characters: two of the longest patterns, or 200 short ones
// Result: the values whose address the pattern matches, part by part. Each part is compared once with each name;
// `budget` is lessened by the part's length each time. Errors: "too_large" where it does not suffice.
Result<OscValues> osc_select(const OscValues& values, const std::string& pattern, std::size_t& budget);

}  // namespace gonio
