// Luminous openings that are given to lights, as text.
#pragma once

#include <optional>
#include <string>

#include "server/scene/light.h"

namespace gonio {

// Result: the opening that the light shines from: its own, or its profile's. Of a sun a point.
ies::Opening opening_of(const Light& light);
// "point", "rect 1.2x0.3", "disc 0.4", "line 1.5", "sphere 0.3" or "box 1.2x0.3x0.1": metres, 0.001 to 100 each, the
// length (along C0) first, and the width. A box has a luminous bottom and sides. Result: nothing for another text.
std::optional<ies::Opening> parse_opening(const std::string& text);
// Result: the same text; of a shape that only files have its name in LM-63's words and its measures.
std::string print_opening(const ies::Opening& opening);

}  // namespace gonio
