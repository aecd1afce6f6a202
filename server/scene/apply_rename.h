// Of apply() alone: a light gets another name, and all that names it follows. Refusals leave as Refused
// (apply_checks.h).
#pragma once

#include <map>
#include <string>
#include <vector>

#include "protocol/schema/messages.h"
#include "server/scene/light.h"

namespace gonio {

struct Scene;

// warnings: gets a sentence for each preset that had to forget another light.
void rename_light(Scene& scene, const v1::RenameLight& rename, std::vector<std::string>& warnings);
// The same of a name that was checked: no light and no group has it.
void give_name(Scene& scene, Light& light, const std::string& new_name, std::vector<std::string>& warnings);
// Renames many lights at once, so that two may exchange their names; costs one pass over all that names lights. The
// names were checked: none is that of a light that keeps its own, or of a group.
void give_names(Scene& scene, const std::map<std::string, std::string>& new_by_old, std::vector<std::string>& warnings);

}  // namespace gonio
