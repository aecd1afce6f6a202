// The options of goniod that concern its bakes: `goniod --bake SCENE --out FOLDER` (docs/lightmaps.md).
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace gonio {

struct BakeOptions {
    std::string scene;             // as of --scene; empty: no bake
    std::vector<std::string> set;  // commands that change the scene before, as gonio takes them
    int size = 1024;               // texels a side
    double texel_m = 0.0;          // 0: as fine as the atlas holds
    std::string uv = "own";        // second
    int directions = 256, bounces = 64;
    double tolerance = 0.002;
    std::string openings = "on", air = "volume", steps_form = "equiangular", format = "float";
    int steps = 30;
    unsigned memory_mib = 4096;
    unsigned seed = 1;
};

void add_bake_options(CLI::App& app, BakeOptions& options);

}  // namespace gonio
