// What of a triangle is not seen: holes of alpha masks, and where a transmissive surface is seen through. Pure; any
// thread. corner1, corner2: weights of the triangle's corners 1 and 2.
#pragma once

#include <cstdint>
#include <optional>

#include "server/lighting/material_table.h"

namespace gonio::lighting {

// Result: how a triangle lets light pass; nothing in a hole of its mask.
std::optional<trace::Transparency> transparency_at(const MaterialTable& material_table, std::uint32_t triangle,
                                                   float corner1, float corner2);
// Where a triangle is looked at: a sample of a pixel.
struct PaneSample {
    int index = -1, count = 16;  // sample `index` of `count`; -1: the only one
    bool back = false;           // of the triangle
    int x = 0, y = 0;            // the pixel
};
// Result: the share of passing light above which a transmissive triangle is seen through (pass_threshold). A pixel's
// samples take each part of 0..1 once, in an order of the instance's side: panes behind each other are independent, and
// triangles side by side are one. Within its part a pixel's thresholds are shifted by an ordered dither, so that the
// mean over 4 × 4 pixels is that of the light.
float pane_threshold(const MaterialTable& material_table, std::uint32_t triangle, const PaneSample& sample);
// Whether a triangle is not seen there.
bool is_hole(const MaterialTable& material_table, std::uint32_t triangle, float corner1, float corner2,
             const PaneSample& sample);
// Whether any material is transmissive.
bool any_pane(const MaterialTable& material_table);

}  // namespace gonio::lighting
