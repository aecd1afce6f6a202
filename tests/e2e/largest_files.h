// The largest files that goniod accepts, or so.
#pragma once

#include <string>

namespace gonio::test {

// A valid Type C file with so many vertical angles, 11 bytes each.
std::string fine_ies(int angles);
// A lit floor of 2 × side² triangles with hills, as one .glb.
std::string hills_glb(int side);

}  // namespace gonio::test
