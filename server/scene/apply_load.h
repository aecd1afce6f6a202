// Of apply() alone: another file takes the place of the scene, and what of it stays. Refusals leave as Refused
// (apply_checks.h).
#pragma once

#include <string>
#include <vector>

#include "protocol/schema/messages.h"
#include "server/scene/apply.h"

namespace gonio {

// warnings: gets what the file or the scene before lose by load.keep.
void load_scene(Scene& scene, const v1::LoadScene& load, const Loaded& loaded, std::vector<std::string>& warnings);

}  // namespace gonio
