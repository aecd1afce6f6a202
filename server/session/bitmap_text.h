// Letters in a picture of bytes: 5 × 8 dots each, for figures and short titles. Pure, any thread.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "protocol/schema/palette.h"

namespace gonio {

// A picture of 4 bytes a pixel, R'G'B' and one that stays; rows from the top. What lies beyond it is not drawn.
struct Pixels {
    std::vector<std::uint8_t>& rgba8;
    int width_px, height_px;
};

inline constexpr int kLetterWide = 6, kLetterHigh = 8;  // dots, the gap to the next included

void fill_box(const Pixels& to, int x, int y, int wide, int high, const Rgb8& color);
// dot_px: side of a dot, 1 or more. ASCII and ² are known; another character is drawn as ?.
void draw_text(const Pixels& to, int x, int y, int dot_px, std::string_view text, const Rgb8& color);
// Result: how many characters draw_text() draws.
int letters(std::string_view text);

}  // namespace gonio
