// goniod --oneshot JOB.json --out DIR: captures without a network, for render farms and tests.
// JOB.json: {"frames":[{"set":[[words of a gonio set command],…],"capture":{"out","view","quality","bounces","noise",
// "openings","size","denoise","max_seconds","legend"}}]}, or {"sequence":{…}} (docs/sequences.md).
#pragma once

#include <string>

#include "server/sequence/run.h"
#include "server/session/scene_access.h"

namespace gonio {

struct Scene;

// access: how the job's commands load scenes. Of a list of frames it applies each frame's commands to the scene and
// writes its capture, a line on stdout each. Result: the exit code. 0; 1 at the first frame that is refused, with its
// place and value on stderr; files of earlier frames stay. 75 after SIGTERM or SIGINT, which must be blocked in all
// threads, and without memory. Of a sequence: sequence::run_sequence(), 78 where it is refused.
int run_oneshot(Scene scene, const std::string& job_file, const SceneAccess& access,
                const sequence::RunOptions& options);

}  // namespace gonio
