// How much captures of the interactive quality look like the path tracer's pictures.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>

namespace gonio::bench {

struct StillsOptions {
    int device = -1;
    std::string scene;  // only this one of cornell, atrium, corridor, stage
    int width_px = 400, height_px = 400;
    unsigned samples = 1024;  // a pixel, of the path tracer's picture: two halves of it are compared too
    std::filesystem::path cache = "build/reference-cache";
    std::string pictures;  // folder to write them to; empty: none
    bool json = false;
};
// FLIP (tests/gl/flip.h) of a capture with one sample a pixel and with the default number, and of the reference's two
// halves; seconds that each took. Also FLIP of denoised pictures of few samples. The references take minutes, and are
// kept in `cache`.
void run_stills(const StillsOptions& options, std::ostream& out, std::ostream& progress);

}  // namespace gonio::bench
