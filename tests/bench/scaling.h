// What a frame of the default technique costs, pass by pass, against the picture's size, the number of VPLs, and the
// scene: with the operations that each pass counts, and the rate that makes.
#pragma once

#include <iosfwd>

namespace gonio {

struct ScalingOptions {
    int device = -1;
    double seconds = 1.0;  // per row
    bool json = false;
};
void run_scaling(const ScalingOptions& options, std::ostream& out);

}  // namespace gonio
