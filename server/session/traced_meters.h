// Meters in reference quality: the points of a request -> their readings. Any thread, no GL.
#pragma once

#include <functional>
#include <stop_token>
#include <vector>

#include "server/session/query.h"
#include "server/trace/reference.h"

namespace gonio {

// Result: readings of the request's points, in their order; those reached so far if stopped. `each` is told of them
// after every few points.
std::vector<v1::MeterReading> traced_readings(const trace::World& world, const MeterRequest& request,
                                              std::stop_token stop,
                                              const std::function<void(const trace::Progress&)>& each);

}  // namespace gonio
