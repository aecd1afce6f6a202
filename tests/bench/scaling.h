// What a frame of the default technique costs, pass by pass, against the picture's size, the scene and its triangles;
// what reflective shadow maps of several sizes cost that use them; and what each effort (server/render/quality_level.h)
// costs.
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
