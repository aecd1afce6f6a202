// What baked maps take and are off by, beside the live transport at the same points; and the cylinder world's known
// values.
#pragma once

#include <iosfwd>
#include <string>

namespace gonio::bench {

struct BakeBenchOptions {
    std::string scene;                    // only this one; empty: cornell, atrium, cylinder
    int width_px = 400, height_px = 400;  // of the picture whose points are compared
    int side = 512, directions = 256;     // texels of the maps, rays of a texel and bounce
    double reference_seconds = 30.0;      // of the path tracer at most, for each scene
    bool reference_case = false;          // the seed's: cylinder with its air, 2304², 256 directions, 30 even steps
    double share = 1.0;                   // of that case's texels a side
    int device = -1;
    bool json = false;
};

// Prints a row for each scene, and of cylinder its means and points. Throws std::runtime_error.
void run_bake(const BakeBenchOptions& options, std::ostream& out, std::ostream& progress);

}  // namespace gonio::bench
