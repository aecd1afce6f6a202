// How right the live light is in scenes that nobody tuned it for: interactive meters beside the path tracer's.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

#include "server/transport/links.h"

namespace gonio::bench {

struct SurveyOptions {
    std::vector<std::string> paths;   // files, folders of .gltf and .glb, or names of built-in scenes
    std::string rooms;                // "SEED:COUNT" of tests/scenes/random_room.h; empty: none
    unsigned picks = 8;               // points of each scene
    double reference_seconds = 20.0;  // of the path tracer for each scene at most
    std::string cache = "build/references";
    unsigned bulbs = 1;                      // in a scene without light: at the eye, and about
    unsigned links = transport::kMostLinks;  // of each surfel; as live light at rest has
    double max_albedo = 0.95;
    int device = -1;
    std::string pictures;  // a folder: of each scene the live picture and the path tracer's, .ppm; empty: none
    bool json = false;
};

// Prints a row for each scene as it goes, and what they say together. A file that cannot be read is a row of its own.
// Throws std::runtime_error where an option is malformed, a path does not exist, or nothing is left to survey.
void run_survey(const SurveyOptions& options, std::ostream& out, std::ostream& progress);

}  // namespace gonio::bench
