#include "server/session/meter_reply.h"

#include <algorithm>
#include <cmath>

#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/measure.pb.h"
#include "protocol/schema/report.pb.h"
#include "server/render/live_renderer.h"
#include "server/trace/sources.h"

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

v1::MeterReading mean_reading(std::span<const v1::MeterReading> readings) {
    if (readings.size() == 1) return readings.front();
    const double count = static_cast<double>(readings.size());
    glm::dvec3 direct(0.0), indirect(0.0);
    double direct_error2 = 0.0, indirect_error2 = 0.0;
    std::uint32_t samples = 0;
    for (const v1::MeterReading& reading : readings) {
        for (int k = 0; k < 3; ++k) {
            direct[k] += reading.direct_rgb_lx(k) / count;
            indirect[k] += reading.indirect_rgb_lx(k) / count;
        }
        direct_error2 += reading.direct_error_lx() * reading.direct_error_lx() / count;
        indirect_error2 += reading.indirect_error_lx() * reading.indirect_error_lx() / count;
        samples += reading.samples();
    }
    const v1::MeterReading& first = readings.front();
    v1::MeterReading mean = lux_reading({first.point_m(0), first.point_m(1), first.point_m(2)}, direct, indirect);
    if (first.has_direct_error_lx()) mean.set_direct_error_lx(std::sqrt(direct_error2));
    if (first.has_indirect_error_lx()) mean.set_indirect_error_lx(std::sqrt(indirect_error2));
    mean.set_samples(samples);
    mean.set_bounces(first.bounces());
    if (const auto reached = noise_reached(readings)) mean.set_noise_reached(*reached);
    return mean;
}

v1::MeterReading with_direct(v1::MeterReading reading, const glm::dvec3& more_lx) {
    for (int k = 0; k < 3; ++k) reading.set_direct_rgb_lx(k, std::max(0.0, reading.direct_rgb_lx(k) + more_lx[k]));
    const double direct_lx =
        trace::luminance(glm::dvec3(reading.direct_rgb_lx(0), reading.direct_rgb_lx(1), reading.direct_rgb_lx(2)));
    reading.set_total_lx(direct_lx + reading.indirect_lx());
    reading.set_direct_lx(direct_lx);
    return reading;
}

Statistics statistics_of(std::span<const v1::MeterReading> readings) {
    double sum = 0.0, least = readings.front().total_lx(), greatest = least;
    for (const v1::MeterReading& reading : readings) {
        sum += reading.total_lx();
        least = std::min(least, reading.total_lx());
        greatest = std::max(greatest, reading.total_lx());
    }
    return {sum / static_cast<double>(readings.size()), least, greatest};
}

std::optional<bool> noise_reached(std::span<const v1::MeterReading> readings) {
    if (!readings.front().has_noise_reached()) return std::nullopt;
    return std::ranges::all_of(readings, &v1::MeterReading::noise_reached);
}

v1::ServerMessage meter_message(std::vector<v1::MeterReading> readings, bool grid) {
    v1::ServerMessage message;
    if (readings.empty()) return message;
    if (!grid) {
        *message.mutable_meter() = std::move(readings.front());
        return message;
    }
    v1::MeterGrid& reply = *message.mutable_meter_grid();
    if (const auto reached = noise_reached(readings)) reply.set_noise_reached(*reached);
    const Statistics statistics = statistics_of(readings);
    reply.set_mean_lx(statistics.mean);
    reply.set_min_lx(statistics.least);
    reply.set_max_lx(statistics.greatest);
    reply.set_uniformity_ratio(statistics.uniformity());
    for (v1::MeterReading& reading : readings) *reply.add_points() = std::move(reading);
    return message;
}

}  // namespace gonio
