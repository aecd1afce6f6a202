#include "server/session/traced_meters.h"

#include <algorithm>

#include "protocol/schema/report.pb.h"
#include "server/base/clock.h"
#include "server/session/meter_reply.h"

namespace gonio {

static constexpr std::size_t kPointsPerCall = 16;  // of a grid, between two looks at the clock

std::vector<v1::MeterReading> traced_readings(const trace::World& world, const MeterRequest& request,
                                              std::stop_token stop,
                                              const std::function<void(const trace::Progress&)>& each) {
    const std::int64_t begin_ns = monotonic_ns();
    std::vector<v1::MeterReading> readings;
    for (std::size_t first = 0; first < request.points.size() && !stop.stop_requested(); first += kPointsPerCall) {
        const std::size_t count = std::min(kPointsPerCall, request.points.size() - first);
        trace::Settings settings = request.settings;
        settings.seed += static_cast<std::uint32_t>(first);  // the errors of a grid's points are independent
        if (settings.max_seconds > 0.0)                      // what is left is shared by the points that are left
            settings.max_seconds =
                std::max(1e-3, (settings.max_seconds - seconds_since(begin_ns)) * static_cast<double>(count) /
                                   static_cast<double>(request.points.size() - first));
        const auto measured = trace::measure(world, std::span(request.points).subspan(first, count), settings, stop);
        for (std::size_t i = 0; i < measured.size(); ++i)
            readings.push_back(meter_reading(request.points[first + i].position, measured[i], settings.bounces));
        const double share = static_cast<double>(readings.size()) / static_cast<double>(request.points.size());
        trace::Progress progress;
        progress.passes = static_cast<std::uint32_t>(readings.size());
        if (share > 0.0) progress.seconds_left = seconds_since(begin_ns) * (1.0 / share - 1.0);
        each(progress);
    }
    return readings;
}

}  // namespace gonio
