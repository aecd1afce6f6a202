// A bake's files in a folder: maps, their sum and its error, what they are (maps.json), and the scene that shows them.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "server/bake/bake.h"

namespace gonio::bake {

struct OutputSettings {
    std::string folder;
    bool half = false;  // EXR of 16 bits, each map at a power of two; else of 32
    bool glb = true;
};

// What a bake told of itself at its end.
struct Summary {
    int width = 0, height = 0;
    std::size_t charts = 0, texels = 0;
    double mean_direct_lx = 0.0, mean_lx = 0.0, error_lx = 0.0;  // of the sum, over area; error: root mean square
    std::vector<std::pair<std::string, double>> means_lx;        // of each source at level 1, all bounces
    std::uint64_t rays = 0;
    double seconds = 0.0;
    int computed = 0, taken_over = 0;  // parts
};

// One file each, whole or not at all: NAME_direct.exr and NAME_indirect.exr of each source; then sum.exr, error.exr,
// sum.ktx2, SCENE.glb, and maps.json last. Parts are in the folder's "parts". Errors: of lay_out, sources_of and bake;
// "file_unwritable".
Result<Summary> bake_to_folder(const Scene& scene, const trace::Geometry& geometry, const BakeSettings& settings,
                               const OutputSettings& output,
                               const std::function<void(const std::string& what, int part, int parts)>& begins,
                               Work& work);

}  // namespace gonio::bake
