// The colour of a luminaire's light as its file tells it, in whatever words: "2700 K", "ww/827", "1B".
#pragma once

#include <optional>

#include "ies/photometry.h"

namespace gonio::ies {

struct LampColour {
    std::optional<double> cct_k;  // correlated colour temperature, 1000..20000
    std::optional<double> cri;    // general colour rendering index Ra, above 0, at most 100
    bool cri_is_least = false;    // it is a bound from below: "> 80", "1B", or the 8 of "830"
    bool operator==(const LampColour&) const = default;
};

// Result: what the keywords for the colour say (of EULUMDAT its fields 26d and 26e, of TM-33 and GLDF their elements),
// else what the lamp's name says. Of a colour code as lamp makers print it, 830, the first digit is Ra / 10 and the
// others are K / 100. DIN 5035's groups 1A, 1B, 2A, 2B, 3 and 4 are 90, 80, 70, 60, 40 and 20 at least. Words alone
// ("warm white") are no temperature, nor are several temperatures.
LampColour lamp_colour(const Photometry& photometry);

}  // namespace gonio::ies
