// What the transport of a scene takes, made beside frames: time, memory, the longest frame meanwhile, and the error of
// the picture that comes of it; of scenes of two million triangles and of a kilometre too.
#pragma once

#include <filesystem>
#include <iosfwd>

namespace gonio::bench {

struct TransportOptions {
    int device = -1;
    std::filesystem::path cache = "build/reference-cache";
    bool json = false;
    double reference_seconds = 600.0;  // ReferenceSettings::seconds
};
// Each scene at 800×800 while the camera moves in every frame. Errors: of the picture at rest before its final gather,
// against all bounces, as of `gonio-bench pareto`.
void run_transport(const TransportOptions& options, std::ostream& out, std::ostream& progress);

}  // namespace gonio::bench
