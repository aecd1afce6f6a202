// gonio-bench frames: frame times with everything recomputed in each frame, in the form of the seed paper's Tables 1
// and 2.
#pragma once

#include <iosfwd>
#include <string>

namespace gonio {

struct FramesOptions {
    std::string scene;  // empty: cornell and atrium
    int width_px = 800, height_px = 800;
    double seconds = 20.0;  // per row, after warm-up; at least 5 frames, at most 50
    bool json = false;
    int device = -1;
};

// Prints one row per scene and technique. Throws std::runtime_error where there is no GL.
void run_frames(const FramesOptions& options, std::ostream& out);

}  // namespace gonio
