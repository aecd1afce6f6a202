// The scenes, luminaires and profiles that benches measure with.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "server/scene/asset.h"

namespace gonio {
struct Scene;
}  // namespace gonio

namespace gonio::bench {

// name: "cornell", "atrium", "corridor", "stage" (16 luminaires), or the path of a .gltf or .glb. Throws
// std::runtime_error with one sentence where it cannot be read or has no luminaire.
std::shared_ptr<const SceneAsset> bench_asset(const std::string& name);

// Result: the same surfaces in more triangles: `times` times each becomes four.
std::shared_ptr<const SceneAsset> split_triangles(const SceneAsset& asset, int times);

// One scene in one light.
struct Case {
    std::string scene;  // as bench_asset takes it
    // "wide": I0 cos² straight down; "beam", "beam12", "beam6": I0 cosⁿ of 24, 12 and 6 degrees, tilted; else the
    // scene's own luminaires as they are. "panel": "wide" from an opening of 0.6 × 0.6 m, in no default list.
    std::string profile;
    int side = 0;  // of the stage's square grid of luminaires; 0: the scene's own
};

// Result: all cases measured by default: cornell, atrium and corridor wide and with a beam, the first two with narrower
// ones too, the stage with 1, 4, 16 and 64 luminaires. scene: only this one's; of a file: the file's own luminaires.
std::vector<Case> bench_cases(const std::string& scene);

// Result: the scene of a case, at 800 × 800 pixels, default technique, all luminaires points but of "panel". Throws as
// bench_asset.
Scene scene_of_case(const Case& which);

}  // namespace gonio::bench
