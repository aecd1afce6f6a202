// How the error of a picture that nobody touches falls with time.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>

namespace gonio::bench {

struct RefinementOptions {
    int device = -1;
    std::string scene;             // only this one of cornell, atrium, corridor
    std::string profile = "wide";  // Case::profile
    std::filesystem::path cache = "build/reference-cache";
    bool json = false;
    double reference_seconds = 600.0;  // ReferenceSettings::seconds
};
// Each scene at 800×800: the live picture and each that refining it shows, after how many
// seconds, and its errors against all bounces as of `gonio-bench pareto`. Errors are measured between the pictures,
// outside the time.
void run_refinement(const RefinementOptions& options, std::ostream& out, std::ostream& progress);

}  // namespace gonio::bench
