// What a false-colour picture says in itself: its scale with quantity, unit and figures, and the figures of its isolux
// lines. Pure, any thread.
#pragma once

#include "server/render/live_renderer.h"
#include "server/scene/view.h"

namespace gonio {

struct Scene;

inline constexpr int kLeastLegend_px = 160;  // side of a picture that has room for it
inline constexpr std::size_t kMostFigures = 256;

// The figure of a line that runs through its middle; pixels from the upper left.
struct LineFigure {
    double value = 0.0;  // of its level, lx or cd/m²
    int x = 0, y = 0;
};
// view, picture: as of draw_legend(); the marks of its lines stay. Result: of each level one in a cell of the picture
// that its line runs through, where no other one is in the way. A line of a few pixels has none. At most kMostFigures.
std::vector<LineFigure> line_figures(const CapturedPicture& picture, const Scene& scene, View view);

// view: illuminance or luminance; the picture shows it of that scene, at least kLeastLegend_px a side, as bytes. A
// pixel's fourth byte below 255 tells which level's line runs there, from 1 on; it becomes 255.
void draw_legend(CapturedPicture& picture, const Scene& scene, View view);

}  // namespace gonio
