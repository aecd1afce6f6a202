// Where the edges of a light's beam lie on surfaces.
#pragma once

#include "ies/core/result.h"
#include "protocol/schema/messages.h"

namespace gonio {

struct Scene;

inline constexpr int kBeamHalfPlanes = 120;  // rays of an edge at most

// Result: the edges of 10 % and 50 % of the greatest intensity of the light's web, and where they meet surfaces. They
// are about the axis of the hemisphere that this intensity lies in; backs and glass count as light meets them.
// Errors: "not_found" (beam.light), "unsupported" (a sun). Some milliseconds of any thread where the scene is traced.
Result<v1::Beam> beam_of(const Scene& scene, const v1::BeamQuery& query);

}  // namespace gonio
