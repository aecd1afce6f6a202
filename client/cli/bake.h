// `gonio bake`: has the goniod beside this program bake a scene's irradiance maps.
#pragma once

#include <string>
#include <vector>

#include "client/cli/commands.h"

namespace gonio {

// Result: goniod's arguments for the words of `gonio bake`, without its name.
std::vector<std::string> bake_arguments(const ReadWords& words);

// Becomes goniod, whose output and exit code are this program's from then on: 0 done, 1 refused or stopped, 2 usage.
// Result: the exit code where it cannot be run.
int bake(const Session& session, const ReadWords& words);

}  // namespace gonio
