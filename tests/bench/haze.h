// What the live picture shows of beams in haze, beside the path tracer: errors, bands and flicker.
#pragma once

#include <iosfwd>
#include <string>

namespace gonio::bench {

struct HazeBenchOptions {
    std::string scene;                // only this one; empty: cornell, atrium, stage
    double extinction_per_m = 0.01;   // of the haze
    double reference_seconds = 60.0;  // of the path tracer at most, for each of its two halves
    int device = -1;
    bool json = false;
};

// Prints a row for each scene. Render thread. Throws std::runtime_error.
void run_haze(const HazeBenchOptions& options, std::ostream& out, std::ostream& progress);

}  // namespace gonio::bench
