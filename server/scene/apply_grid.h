// Of apply(): calculation grids, and the observers whose glare is rated.
#pragma once

#include <string>

#include "protocol/schema/messages.h"

namespace gonio {

struct Scene;

// All on the render thread, on apply()'s copy of the scene; they throw Refused (apply_checks.h) and then have changed
// nothing. Codes: "invalid_argument", "not_found" (a grid, view, target or observer), "too_large", "too_many_grids",
// "too_many_observers". What is kept has its defaults, and the values of its target, filled in.
void set_grid(Scene& scene, const v1::Grid& grid);
void remove_grid(Scene& scene, const std::string& name);
void set_observer(Scene& scene, const v1::Observer& observer);
void remove_observer(Scene& scene, const std::string& name);

}  // namespace gonio
