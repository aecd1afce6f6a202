// goniod as gonio runs it for what needs the renderer: the program in gonio's own folder.
#pragma once

#include <string>
#include <vector>

#include "client/cli/commands.h"

namespace gonio {

// This process becomes goniod with these arguments, whose exit code counts then. Result: the exit code where it cannot
// be run.
int become_goniod(const Session& session, const std::vector<std::string>& arguments);

// Result: what goniod is given for `gonio doctor`.
std::vector<std::string> doctor_arguments(const ReadWords& words, bool json);
int doctor(const Session& session, const ReadWords& words);

}  // namespace gonio
