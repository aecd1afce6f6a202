// THE table of the palettes of false colour: shaders, captures and the page show its colours, and no others.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace gonio {

using Rgb8 = std::array<std::uint8_t, 3>;  // R'G'B' as a display takes it, sRGB

struct Palette {
    std::string_view name;
    std::string_view help;        // what it is for
    std::span<const Rgb8> stops;  // equally far apart from the least value to the greatest; linear between them
    Rgb8 under, over;             // of what lies beyond the scale: no colour of the stops
};

inline constexpr std::size_t kPaletteColors = 256;  // that a palette is made into
inline constexpr Rgb8 kBelowMark = {226, 0, 150};   // of what is below the threshold

// Result: those that set_view takes, the default first.
std::span<const Palette> palettes();
// Result: the palette of differences: its middle stands for none.
const Palette& difference_palette();
// Result: null where there is none of this name.
const Palette* find_palette(std::string_view name);

// Result: R'G'B' for t in 0..1, each component 0..255.
std::array<float, 3> color_at(const Palette& palette, float t);

// Result: the table as a JavaScript module: `palettes`, by name {help, colors, under, over}, and `belowMark`; colours
// are [R', G', B'] of 0..255. "difference" is among them.
std::string palettes_module();

}  // namespace gonio
