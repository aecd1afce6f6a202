// Of apply(): the next edition of the MVR show that the scene came from. What the file changed since the last import is
// changed here; what was made of the scene here stays. Refusals leave as Refused (apply_checks.h).
#pragma once

#include <string>
#include <vector>

#include "protocol/schema/messages.h"
#include "server/scene/apply.h"

namespace gonio {

// lines: get what is changed, or with load.dry_run would be (merge_report.h); then the scene stays as it is.
void merge_show(Scene& scene, const v1::LoadScene& load, const Loaded& loaded, std::vector<std::string>& lines);

}  // namespace gonio
