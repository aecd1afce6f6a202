// `goniod --bake`: a scene's irradiance maps, without a server.
#pragma once

#include "server/app/options.h"

namespace gonio {

struct Scene;

// Bakes the scene into the folder options.out. Progress goes to stderr, a line of what was made to stdout. SIGINT and
// SIGTERM end it; what is finished stays and is taken over next time. Result: the exit code: 0, 1 refused or stopped.
int run_bake(const Options& options, Scene scene);

}  // namespace gonio
