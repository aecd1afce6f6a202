// The tokens that clients show, and what each lets them do. Pure.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace gonio {

enum class Right : std::uint8_t { none, look, change };  // look: see and ask, whatever role the client asks for

struct Tokens {
    std::string all;     // to do anything; empty: none is asked for
    std::string viewer;  // to look only; empty: there is none

    bool asked() const { return !all.empty(); }
    Right right_of(std::string_view given) const;
};

// Result: whether both are equal, in a time that depends on the length of `given` only.
bool equal_in_constant_time(std::string_view given, std::string_view secret);

}  // namespace gonio
