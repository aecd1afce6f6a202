// What a scene's indirect light is compared with, computed once and kept on disk by the content it was computed from.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <vector>

#include "tests/bench/receivers.h"

namespace gonio::bench {

struct ReferenceSettings {
    int cells = 64;          // per side of the picture: one pixel in each
    int rsm_size = 256;      // texels per face side of the dense sum's map
    double noise = 0.005;    // of the truths: root of the mean variance over the mean
    double seconds = 600.0;  // spent on each of the two truths at most; what is reached by then is kept, and stated
};

struct Reference {
    std::vector<Receiver> receivers;
    std::size_t empty_pixels = 0;        // of those chosen: no surface, left out
    std::size_t seam_pixels = 0;         // of those chosen: where two surfaces meet, left out; see reference_of
    std::vector<double> rsm_lx;          // one unoccluded bounce, dense sum
    std::vector<double> truth_lx;        // one bounce with exact visibility, path traced
    std::vector<double> truth_variance;  // of it, lux²
    std::vector<double> all_lx;          // every bounce, path traced
    std::vector<double> all_variance;    // of it, lux²
    bool cached = false;                 // came from disk
};

// Result: the references of the scene's indirect light at its camera and size. Left out are pixels whose centre shows
// the seam of two surfaces to a hundred-thousandth of the scene: which side of the other surface such a point is on,
// and with it whether it is lit at all, is a matter of rounding. cache: folder, made if missing; files are named by a
// hash of everything that the values follow from, and one that is cut short or of another format is computed anew. Says
// on `progress` what it is at. Render thread. Throws std::runtime_error where the folder cannot be written.
Reference reference_of(const Scene& scene, const ReferenceSettings& settings, const std::filesystem::path& cache,
                       std::ostream& progress);

}  // namespace gonio::bench
