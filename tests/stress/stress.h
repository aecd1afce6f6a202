// Stability under stress: adversarial and random scenes through every pass, every buffer checked (docs/stability.md).
// One function per case; each adds its findings, with bounds stated beside the measurement.
#pragma once

#include <chrono>
#include <cstdint>
#include <iosfwd>
#include <random>
#include <string>

#include <CLI/CLI.hpp>

#include "server/render/renderer.h"
#include "tests/stress/findings.h"

namespace gonio::stress {

// Of the renderer, but where a case says otherwise: many scenes are made.
inline constexpr unsigned kLinks = 128;

struct Options {
    double seconds = 120.0;  // about; shared among the cases, the random scenes take what is left
    std::uint64_t seed = 1;
    std::string only;  // name of one case; empty: all
    bool json = false;
    int device = -1;
};

// What every case works with.
struct Bench {
    Renderer& renderer;  // one for all cases: what it keeps from one scene must not show in the next
    Findings& findings;
    std::uint64_t seed = 1;
    bool brief = false;  // a subset of the sweeps, for the test suite
    std::chrono::steady_clock::time_point until;
    std::string group;    // the case that runs
    std::string context;  // what is being driven, for findings of buffers
};

void contact(Bench& bench);      // luminaire, camera and meters touching, inside and behind surfaces
void singularity(Bench& bench);  // receivers near bright texels; bias of the bounded kernel near edges and corners
void scale(Bench& bench);        // scenes from millimetres to kilometres, up to 100 km from the origin
void intensity(Bench& bench);    // 1e-3 to 1e9 cd side by side
void degenerate(Bench& bench);   // pencil beams, triangles and texture coordinates without area, extreme albedo
void seams(Bench& bench);        // flux of mask and RSM in every direction
void steps(Bench& bench);        // small turns and moves of a luminaire
void convergence(Bench& bench);  // RSM resolutions
void bounces(Bench& bench);      // every bounce: reflectances up to 0.99, surfaces that coincide
void cavities(Bench& bench);     // light that arrives late: ports, keyholes, slits, closed and random rooms
void fuzz(Bench& bench);         // random scenes

// Adds `stress` with its options. Result: the subcommand; options live until the arguments are parsed.
CLI::App* add_subcommand(CLI::App& app, Options& options);

// Runs the cases and prints the findings. Result: the exit code: 0, 1 on a failed bound, 77 where there is no GL.
int run_stress(const Options& options, std::ostream& out);

}  // namespace gonio::stress
