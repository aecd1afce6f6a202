// Which texels lie inside something: they see the backs of solids. Any thread. No files.
#pragma once

#include <stop_token>
#include <vector>

#include "server/bake/atlas.h"

namespace gonio::bake {

inline constexpr double kMostBacks = 0.25;  // of a texel's directions that may end on the back of a solid
inline constexpr int kBackDirections = 256;

// Result: of each instance 1 if it is a solid: one-sided, and its surface closed, or open along one plane only, as a
// box without its bottom. Its fronts are outside: a room that is modelled from within is none.
std::vector<char> solids_of(const trace::Geometry& geometry);

// Result: whether more than kMostBacks of the directions over the texel meet the back of a solid.
bool is_inside(const trace::Geometry& geometry, const std::vector<char>& solids, const Texel& texel);

// Makes texels inside something invalid. Result: false if a stop came before.
bool find_invalid(Atlas& atlas, const trace::Geometry& geometry, int threads, const std::stop_token& stop);

}  // namespace gonio::bake
