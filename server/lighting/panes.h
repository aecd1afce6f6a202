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
// Whether a triangle is not seen there. pane_sample: of pass_threshold.
bool is_hole(const MaterialTable& material_table, std::uint32_t triangle, float corner1, float corner2,
             int pane_sample);
// Whether any material is transmissive.
bool any_pane(const MaterialTable& material_table);

}  // namespace gonio::lighting
