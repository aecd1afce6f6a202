#include "server/session/meter_reply.h"

#include <algorithm>

#include "server/render/live_renderer.h"

namespace gonio {

v1::MeterReading meter_reading(const glm::dvec3& point_m, const trace::Reading& found, int bounces) {
    v1::MeterReading reading = lux_reading(point_m, found.direct_lx, found.indirect_lx);
    reading.set_direct_error_lx(found.direct_error_lx);
    reading.set_indirect_error_lx(found.indirect_error_lx);
    reading.set_samples(found.samples);
    reading.set_noise_reached(found.noise_reached);
    reading.set_bounces(bounces == trace::kAllBounces ? "all" : std::to_string(bounces));
    return reading;
}

v1::ServerMessage meter_message(std::vector<v1::MeterReading> readings, bool grid) {
    v1::ServerMessage message;
    if (readings.empty()) return message;
    if (!grid) {
        *message.mutable_meter() = std::move(readings.front());
        return message;
    }
    v1::MeterGrid& reply = *message.mutable_meter_grid();
    if (readings.front().has_noise_reached()) {
        reply.set_noise_reached(std::all_of(readings.begin(), readings.end(),
                                            [](const v1::MeterReading& reading) { return reading.noise_reached(); }));
    }
    double sum = 0.0, least = readings.front().total_lx(), greatest = least;
    for (const v1::MeterReading& reading : readings) {
        sum += reading.total_lx();
        least = std::min(least, reading.total_lx());
        greatest = std::max(greatest, reading.total_lx());
    }
    const double mean = sum / static_cast<double>(readings.size());
    reply.set_mean_lx(mean);
    reply.set_min_lx(least);
    reply.set_max_lx(greatest);
    reply.set_uniformity_ratio(mean > 0.0 ? least / mean : 0.0);
    for (v1::MeterReading& reading : readings) *reply.add_points() = std::move(reading);
    return message;
}

}  // namespace gonio
