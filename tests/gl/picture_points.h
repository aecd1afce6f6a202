// What a live picture's pixels show, for truths to be computed there.
#pragma once

#include <cstddef>
#include <vector>

#include "server/trace/geometry.h"
#include "server/trace/reference.h"

namespace gonio::test {

struct PicturePoints {
    std::vector<trace::MeterPoint> points;
    std::vector<std::size_t> pixels;  // row · width + column, rows from the bottom
};
// Result: of every step-th row and column, from step / 2 on, those pixels that show a surface.
PicturePoints points_of(const Scene& scene, const trace::Geometry& geometry, int step);

}  // namespace gonio::test
