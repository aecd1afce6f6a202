// The estimators of the reference in haze: volumetric path tracing with the same phase function as everywhere
// (server/scene/haze.h), every order of scattering. Local coordinates; any thread.
#pragma once

#include "server/trace/path.h"

namespace gonio::trace {

// As trace_path(), of a world with haze: events on surfaces and in the air both count as bounces.
PathLight trace_path_in_haze(const World& world, Receiver receiver, int bounces, Sample& sample);

// Result: one unbiased sample of the light that haze scatters towards `from` along a ray before `far`, cd/m². Of one
// that meets nothing `far` is infinite.
glm::vec3 scattered_light(const World& world, const glm::vec3& from, const glm::vec3& direction, float far, int bounces,
                          Sample& sample);

}  // namespace gonio::trace
