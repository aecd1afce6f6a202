// What the picture shows at a place: the surface that a ray from the camera meets first.
#pragma once

#include "ies/core/result.h"
#include "protocol/schema/measure.pb.h"
#include "protocol/schema/messages.h"
#include "server/trace/reference.h"

namespace gonio {

struct Scene;

struct Picked {
    v1::Pick pick;            // without its light
    trace::MeterPoint point;  // where that is measured; nothing where nothing is hit
    glm::dvec3 reflectance{0.0}, emission_nit{0.0};
};
// Result: what the scene's camera sees there. Backs of one-sided surfaces are looked through as in pictures, and so is
// glass that lets more than half of the light pass. Errors: "invalid_argument" (pick.x, pick.y). Some microseconds of
// any thread where the scene is traced.
Result<Picked> pick_at(const Scene& scene, const v1::PickQuery& query);
// Result: the answer, with the light that was measured there. All surfaces are diffuse: L = rho E / pi + its own.
v1::Pick with_reading(const Picked& picked, v1::MeterReading reading);

}  // namespace gonio
