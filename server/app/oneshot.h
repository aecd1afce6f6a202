// goniod --oneshot JOB.json --out DIR: captures without a network, for render farms and tests.
// JOB.json: {"frames":[{"set":[[words of a gonio set command],…],"capture":{"out","view","quality","bounces","noise",
// "openings","size","denoise","max_seconds","legend"}}]}
#pragma once

#include <string>

#include "server/render/renderer.h"
#include "server/scene/scene.h"
#include "server/session/scene_access.h"

namespace gonio {

inline constexpr std::size_t kMaxJobBytes = 16u << 20;  // a longer JOB.json is refused

// access: how the job's commands load scenes. Applies each frame's commands to the scene and writes its capture into
// the folder `out` (written beside, then renamed). Prints one line per frame. Result: the exit code: 0, or 1 at the
// first frame that is refused, with its place and value on stderr; files of earlier frames stay.
int run_oneshot(Renderer& renderer, Scene scene, const std::string& job_file, const std::string& out,
                const SceneAccess& access);

}  // namespace gonio
