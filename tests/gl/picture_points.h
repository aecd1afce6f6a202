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

// Such points and the path tracer's light there after every bounce, to this noise.
struct TracedPoints : PicturePoints {
    std::vector<trace::Reading> truth;
};
TracedPoints traced_points(const Scene& scene, int step, double noise);
// Result: rms of what a picture shows there less the truth (luminance of indirect light), over the truth's mean.
double rms_of(const TracedPoints& traced, const std::vector<glm::vec3>& shown_lx);

}  // namespace gonio::test
