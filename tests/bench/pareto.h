// gonio-bench pareto: run time against error of every technique, the seed's at several budgets, in one process.
#pragma once

#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

#include "server/gl/context.h"
#include "tests/bench/errors.h"

namespace gonio::bench {

struct ParetoOptions {
    // Only these, where given: scene as of bench_asset, profile and technique by name, number of luminaires.
    std::string scene, profile, technique;
    std::size_t lights = 0;
    int width_px = 0, height_px = 0;  // 0: 800 × 800; quick: 192 × 192. Made even
    // Of frames per row, after warm-up; of the seed technique 10 at most. At least 5 frames, at most 50.
    double seconds = 30.0;
    bool quick = false;  // one case, few frames, a coarser reference: for checking that it works
    std::filesystem::path cache = "build/reference-cache";
    double reference_seconds = 600.0;  // ReferenceSettings::seconds
};

// One technique at one budget in one case.
struct ParetoRow {
    std::string scene, profile, technique;
    std::size_t lights = 0, triangles = 0;
    unsigned samples = 0;
    double frame_ms = 0.0, frame_p95_ms = 0.0, indirect_ms = 0.0;  // everything recomputed
    double move_ms = 0.0, move_indirect_ms = 0.0;                  // only the first luminaire moves; 0: a seed row
    // What a step of a millimetre of the first luminaire changes, rms over receivers, over a twentieth of what 20 mm
    // change: of 20 steps the median and the greatest; 0: a seed row.
    double motion_over_due = 0.0, motion_most = 0.0;
    std::size_t frames = 0;
    // Of what is shown while the first luminaire moves: every bounce by the default technique, one by the seed's.
    Errors rsm;            // against the dense sum
    Errors truth, all;     // against the path tracer, its first bounce and all of them
    double mean_lx = 0.0;  // of the first bounce
    std::size_t points = 0, empty_pixels = 0, seam_pixels = 0;
    double seed_rate_ratio = 0.0;  // time that the micro-benchmark predicts over the time measured; 0: not a seed row
    bool is_void = false;          // a seed row off its prediction by more than 30 %
    bool front = false;            // no valid row of the same case is both faster and nearer to all bounces
    bool cached = false;           // the reference came from disk
};

struct ParetoResult {
    std::vector<ParetoRow> rows;
    std::string renderer, cpu;
    unsigned threads = 0;
    double load_before = 0.0, load_after = 0.0;  // 1 minute load average, of the machine before and its own at the end
    int width_px = 0, height_px = 0;
    double noise_wanted = 0.0;
    int rsm_size = 0;
    bool quick = false;
};

// Result: the rows of all cases that the options leave, fronts marked. Says on `progress` what it is at. Thread: the
// context's. Throws std::runtime_error where nothing is left to measure, or as bench_asset and reference_of.
ParetoResult run_pareto(const gl::Context& context, const ParetoOptions& options, std::ostream& progress);

void print_pareto(const ParetoResult& result, std::ostream& out);  // a table to read
void write_json(const ParetoResult& result, std::ostream& out);
void write_csv(const ParetoResult& result, std::ostream& out);
std::string pareto_svg(const ParetoResult& result);  // valid rows only

}  // namespace gonio::bench
