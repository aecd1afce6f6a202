// A calculation grid -> the meters that read it -> its values, statistics and checks. Pure functions, any thread.
#pragma once

#include "ies/core/result.h"
#include "protocol/schema/messages.h"
#include "server/session/query.h"

namespace gonio {

struct Scene;

// Result: the points of the grid that the query names; they are answered by GridValues. Errors: "not_found" (grid.name,
// grid.view), and as of check_meter.
Result<MeterRequest> check_grid(const Scene& scene, const v1::GridQuery& query);

// Result: what a target says of these values: Em or Ez, and U0. quantity: of the grid. A U0 beside an Em is of that.
std::vector<v1::TargetCheck> check_target(const v1::Target& target, const std::string& quantity, double mean_lx,
                                          double uniformity_ratio);

// Result: whether the quantity is a cylindrical illuminance: a target's Ez is its.
bool is_cylindrical(const std::string& quantity);

}  // namespace gonio
