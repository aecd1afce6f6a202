// What filtering reads beside the texels that were computed: invalid ones and gutters take the mean of their neighbours
// on the same sheet, ring by ring, never of another sheet. Any thread. No files.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/bake/atlas.h"

namespace gonio::bake {

// Who takes whose mean, in order. Pixels of the atlas.
struct FillPlan {
    std::vector<std::int32_t> pixel;
    std::vector<std::uint32_t> first;    // index into source; one more than pixels
    std::vector<std::int32_t> source;    // pixels that have a value by then
    std::vector<std::int32_t> sheet_at;  // of each pixel, gutters included; -1: none
};
FillPlan plan_fill(const Atlas& atlas);

// values: of the atlas's texels, `channels` each. Result: of all pixels, row by row, filled; 0 where nothing is.
std::vector<float> picture_of(const Atlas& atlas, const FillPlan& plan, std::span<const float> values, int channels);
// Sets the values of invalid texels alone, as the picture has them.
void fill_invalid(const Atlas& atlas, const FillPlan& plan, std::span<float> values, int channels);

// Result: bilinear, as a GPU reads it: texel centres at half coordinates; the edge's texels beyond it. at: texels.
float bilinear(std::span<const float> picture, int width, int height, int channels, int channel, const glm::dvec2& at);

}  // namespace gonio::bake
