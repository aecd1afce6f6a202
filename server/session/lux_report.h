// The lux report: a scene's pictures, calculation grids, glare and luminaires, in reference quality, on one page that
// prints. Any thread, no GL.
#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "protocol/schema/grid.pb.h"
#include "protocol/schema/messages.h"
#include "server/session/query.h"
#include "server/trace/reference.h"

namespace gonio {

inline constexpr double kReportNoise = 0.05;  // of pictures; where a query names none

struct LuxReportRequest {
    std::string title, date;  // date: when the scene was as it is, for people
    std::vector<CaptureRequest> pictures;
    std::vector<MeterRequest> meters;  // of all grids, then of all observers
    std::size_t parts() const { return pictures.size() + meters.size(); }
};
// date: for people. Errors: "invalid_argument" (title, size, bounces, noise, seconds).
Result<LuxReportRequest> check_lux_report(const Scene& scene, const v1::LuxReportQuery& query, std::string date);

// What the report tells of a scene.
struct LuxReportParts {
    struct Picture {
        View view = View::beauty;
        std::string image;  // the bytes of a file
        std::string type;   // "image/png"
        double noise = 0.0;
        std::uint32_t samples = 0;
        bool noise_reached = true;
    };
    std::vector<Picture> pictures;
    std::vector<v1::GridValues> grids;
    std::vector<v1::Ugr> observers;
};

// Computes all parts; `each` is told how many there are (passes). Result: a LuxReport, or a Result with the refusal of
// a part; no message if stopped.
v1::ServerMessage traced_report(std::shared_ptr<const trace::World> world, const Scene& scene,
                                const LuxReportRequest& request, std::stop_token stop,
                                const std::function<void(const trace::Progress&)>& each);

// Result: the page, HTML5 in UTF-8: no script, no reference to anything outside of it.
std::string lux_report_html(const Scene& scene, const LuxReportRequest& request, const LuxReportParts& parts);

}  // namespace gonio
