// The same scenes in Blender's Cycles: what it is given, and how its pictures compare.
#pragma once

#include <string>
#include <vector>

#include "server/gl/context.h"

namespace gonio::accuracy {

inline constexpr int kCrossPx = 128;             // the pictures' width and height
inline constexpr double kCrossTolerance = 0.02;  // of Cycles' mean, for the reference's mean
inline constexpr double kCrossBlocks = 0.03;     // for its blocks: where the light lies, not only how much

// Writes DIRECTORY/RUN.glb for every run: the built-in scene cornell with one luminaire and one camera. Result: the
// runs' names. Throws std::runtime_error where a file cannot be written.
std::vector<std::string> write_cross_scenes(const std::string& directory);

// Means of illuminance in lux over the pixels that a surface fills, direct or after one bounce.
struct CrossRow {
    std::string run, part;  // "wide", "direct"
    double cycles = 0.0, reference = 0.0, interactive = 0.0;
    double worst_channel = 0.0;     // largest relative difference of the reference's r, g, b means
    double reference_blocks = 0.0;  // rms difference of the means of 8 x 8 blocks, relative to the picture's mean
    double interactive_blocks = 0.0;
    double cycles_at_points = 0.0, rsm_at_points = 0.0;  // means over a grid of 16 x 16 pixels
};

// Reads DIRECTORY/RUN-direct.exr and RUN-indirect.exr (irradiance in lux, rgb, kCrossPx square) beside the scenes and
// measures the same. Needs EGL. Throws std::runtime_error where a file is missing or of another size.
std::vector<CrossRow> compare_with_cycles(const gl::Context& context, const std::string& directory);

std::string cross_markdown(const std::vector<CrossRow>& rows);

}  // namespace gonio::accuracy
