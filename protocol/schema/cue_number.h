// The number of a cue: 0.001 to 9999.999 in exact thousandths, so that 1.1 stands before 1.11 and 2.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace gonio {

inline constexpr std::uint32_t kMostCueNumber = 9'999'999;  // thousandths

// Result: thousandths, 1 to kMostCueNumber; nothing where it is no such number: "12", "0.5", ".5", "7.250".
std::optional<std::uint32_t> parse_cue_number(std::string_view text);
// Result: "12", "0.5": without needless zeros; of 0 "".
std::string print_cue_number(std::uint32_t thousandths);

}  // namespace gonio
