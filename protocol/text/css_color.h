// Colours as people write them.
#pragma once

#include <array>
#include <optional>
#include <string_view>

namespace gonio {

// Result: linear Rec.709, 0 to 1 each, of a name of CSS in any case ("DarkOrange"), of "#rrggbb" or "#rgb", which are
// sRGB; nothing for any other text. Source: CSS Color Module Level 4, clauses 6.1 and 5.2; IEC 61966-2-1 for sRGB.
std::optional<std::array<double, 3>> parse_css_color(std::string_view text);

}  // namespace gonio
