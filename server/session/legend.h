// What a false-colour picture says in itself: its scale with quantity, unit and figures, and the figures of its isolux
// lines. Pure, any thread.
#pragma once

#include "server/render/live_renderer.h"
#include "server/scene/scene.h"

namespace gonio {

inline constexpr int kLeastLegend_px = 160;  // side of a picture that has room for it

// view: illuminance or luminance; the picture shows it of that scene, at least kLeastLegend_px a side, as bytes. A
// pixel's fourth byte below 255 tells which level's line runs there, from 1 on; it becomes 255.
void draw_legend(CapturedPicture& picture, const Scene& scene, View view);

}  // namespace gonio
