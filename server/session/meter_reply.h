// Readings -> the answer to a meter query. Pure functions, any thread.
#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

#include "protocol/schema/messages.h"
#include "server/trace/reference.h"

namespace gonio {

// What a meter finds at a point: lux per channel, standard errors of the luminance in lux.
v1::MeterReading meter_reading(const glm::dvec3& point_m, const trace::Reading& reading,
                               int bounces = trace::kAllBounces);

// Result: the mean of readings, at the first one's point; errors are those of readings that err alike. readings: at
// least one.
v1::MeterReading mean_reading(std::span<const v1::MeterReading> readings);

// Result: the reading with so much more direct light, lux.
v1::MeterReading with_direct(v1::MeterReading reading, const glm::dvec3& more_lx);

struct Statistics {
    double mean = 0.0, least = 0.0, greatest = 0.0;
    double uniformity() const { return mean > 0.0 ? least / mean : 0.0; }         // U0 of EN 12464-1
    double diversity() const { return greatest > 0.0 ? least / greatest : 0.0; }  // Ud
};
// Result: of total_lx. readings: at least one.
Statistics statistics_of(std::span<const v1::MeterReading> readings);
// Result: whether all reached the noise that was asked for; nothing where none was.
std::optional<bool> noise_reached(std::span<const v1::MeterReading> readings);

// readings: one, or those of a grid with its mean, least, greatest and uniformity.
v1::ServerMessage meter_message(std::vector<v1::MeterReading> readings, bool grid);

}  // namespace gonio
