// Of apply() alone: undo and redo set properties back. What cannot be set back any more stays and is said.
#pragma once

#include <string>
#include <vector>

#include "server/scene/edit.h"

namespace gonio {

// targets: in the order of their keys. warnings: gets a sentence for each that stays.
void set_back(Scene& scene, const std::vector<EditTarget>& targets, std::vector<std::string>& warnings);

}  // namespace gonio
