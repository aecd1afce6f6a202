// The instruction set that Embree uses.
#pragma once

#include <string>

namespace gonio::trace {

// Of all that is made after it: "avx2", "avx512"; empty: the machine's best. Before any thread makes a Geometry.
void set_embree_isa(const std::string& isa);

}  // namespace gonio::trace
