// Readings -> the answer to a meter query. Pure functions, any thread.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "protocol/schema/gonio.pb.h"
#include "server/trace/reference.h"

namespace gonio {

// What a meter finds at a point: lux per channel, standard errors of the luminance in lux.
v1::MeterReading meter_reading(const glm::dvec3& point_m, const trace::Reading& reading,
                               int bounces = trace::kAllBounces);

// readings: one, or those of a grid with its mean, least, greatest and uniformity.
v1::ServerMessage meter_message(std::vector<v1::MeterReading> readings, bool grid);

}  // namespace gonio
