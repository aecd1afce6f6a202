// The unified glare rating of an observer: which luminaires glare, before which background. Any thread.
#pragma once

#include <vector>

#include "ies/core/result.h"
#include "protocol/schema/messages.h"
#include "server/session/query.h"

namespace gonio {

struct Scene;

// Result: every luminaire that is on, with its part in CIE 117's sum or why it has none. It has none behind the eye,
// below the line of sight, and beside or above what Guth's table covers. Nor has it where a ray to its centre is
// stopped, or where it shows no luminous opening. direction: unit, the line of sight. Suns are not listed.
std::vector<v1::GlareSource> glare_sources(const Scene& scene, const glm::dvec3& eye, const glm::dvec3& direction);

// Result: the meter of the indirect light at the eye; it is answered by Ugr. Errors: "not_found" (ugr.observer),
// "invalid_argument" (an eye and a direction beside an observer, or neither; no bounce), and as of check_meter.
Result<MeterRequest> check_ugr(const Scene& scene, const v1::UgrQuery& query);

}  // namespace gonio
