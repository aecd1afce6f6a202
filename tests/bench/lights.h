// gonio-bench lights: what a change costs with 1, 4, 16 and 64 luminaires over the stage, and of what runs the
// composite only with the one luminaire of cornell and of atrium.
#pragma once

#include <cstddef>
#include <iosfwd>
#include <map>
#include <string>
#include <vector>

namespace gonio::bench {

struct LightsOptions {
    int width_px = 800, height_px = 800;
    double seconds = 5.0;     // per row, after warm-up; at least 10 frames, at most 100
    std::string scene;        // only this one of stage, cornell, atrium; empty: all
    std::size_t lights = 0;   // only this many luminaires; 0: all numbers
    std::string change;       // only this one of LightsRow::change; empty: all
    double haze_per_m = 0.0;  // extinction; 0: there is none
    bool json = false;
    int device = -1;
};

// One change made in every frame of a scene under so many luminaires, nothing else moving. Times are from draining the
// queue to NV12 in memory with the H.264 encoder beside it.
struct LightsRow {
    std::string scene;
    std::size_t lights = 0;
    std::string change;  // level_one, color_one, level_all, exposure, move_one, orbit
    double frame_ms = 0.0, frame_p95_ms = 0.0;
    double rate = 0.0;  // frame rate over that of one luminaire under the same change; 0: not measured
    std::size_t frames = 0;
    std::size_t settling_frames = 0;  // without a further change until the report says settled
    double settling_ms = 0.0;
    std::map<std::string, double> pass_ms;  // medians; of all luminaires together
};

// Prints one row per number of luminaires and change. Throws std::runtime_error where there is no GL.
void run_lights(const LightsOptions& options, std::ostream& out);

}  // namespace gonio::bench
