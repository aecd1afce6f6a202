// Grids, glare and targets as text.
#pragma once

#include <string>

#include "protocol/schema/messages.h"

namespace gonio {

// Result: statistics, checks, how it was computed, what was left out, and the values as a plan: u to the right, v up.
std::string grid_text(const v1::GridValues& values);
// Result: a line for each point under a line of names: i, j, x_m, y_m, z_m, lx, left_out: "inside", "outside" or
// nothing.
std::string grid_csv(const v1::GridValues& values);
// Result: a line for each.
std::string grids_table(const v1::Grids& grids);
std::string observers_table(const v1::Observers& observers);
std::string targets_table(const v1::Targets& targets);
// Result: the rating, how it was computed, and a line for each luminaire.
std::string ugr_text(const v1::Ugr& ugr);

}  // namespace gonio
