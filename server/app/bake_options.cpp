#include "server/app/bake_options.h"

#include <CLI/CLI.hpp>

#include "server/app/option_checks.h"
#include "server/bake/bake.h"

namespace gonio {

void add_bake_options(CLI::App& app, BakeOptions& options) {
    constexpr const char* kGroup = "Bake";
    const auto add = [&](const char* name, auto& value, const std::string& text) {
        return app.add_option(name, value, text)->group(kGroup)->configurable(false);
    };
    add("--bake", options.scene,
        "SCENE: bake its irradiance into maps in the folder --out, and end, without a network (docs/lightmaps.md)")
        ->check(check_scene);
    add("--bake-set", options.set,
        "a command that changes the scene before it is baked, in gonio's words: \"haze show\", \"light key --level "
        "1\"");
    add("--bake-size", options.size, "texels a side of the maps, 16..8192")->check(CLI::Range(16, bake::kMostSide));
    add("--bake-texel", options.texel_m, "side of a texel in m; 0: as fine as the maps' size holds")
        ->check(finite_in(0.0, 1000.0));
    add("--bake-uv", options.uv, "own: charts of its own; second: the file's TEXCOORD_1")
        ->check(CLI::IsMember({"own", "second"}));
    add("--bake-directions", options.directions, "rays of a texel and bounce, 32..65536, in steps of 32")
        ->check(CLI::Range(32, bake::kMostDirections));
    add("--bake-bounces", options.bounces, "at most so many, 0..64")->check(CLI::Range(0, bake::kMostBounces));
    add("--bake-tolerance", options.tolerance, "ends when what further bounces add is a smaller share of all, 0..0.5")
        ->check(finite_in(0.0, 0.5));
    add("--bake-openings", options.openings, "on: luminaires shine from their luminous openings; off: from points")
        ->check(CLI::IsMember({"on", "off"}));
    add("--bake-steps", options.steps, "samples of the haze along a ray, 1..1024")
        ->check(CLI::Range(1, bake::kMostSteps));
    add("--bake-steps-form", options.steps_form, "where they lie: equiangular about the luminaire, or even")
        ->check(CLI::IsMember({"equiangular", "even"}));
    add("--bake-air", options.air, "what reaches the haze: volume (coarse), rays (a shadow ray for each sample)")
        ->check(CLI::IsMember({"volume", "rays"}));
    add("--bake-format", options.format, "of the EXR files: float (32 bits), half (16 bits)")
        ->check(CLI::IsMember({"float", "half"}));
    add("--bake-memory", options.memory_mib, "MiB that maps and texels may take, 16..1048576")
        ->check(CLI::Range(16u, 1u << 20));
    add("--bake-seed", options.seed, "of the samples: the same one gives the same maps");
}

}  // namespace gonio
