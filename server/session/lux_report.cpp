#include "server/session/lux_report.h"

#include <algorithm>
#include <cmath>

#include "protocol/schema/codec.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/grid.pb.h"
#include "protocol/schema/measure.pb.h"
#include "protocol/text/shortened_text.h"
#include "server/scene/apply.h"
#include "server/scene/apply_checks.h"
#include "server/scene/limits.h"
#include "server/scene/scene.h"
#include "server/session/capture_file.h"
#include "server/session/glare.h"
#include "server/session/grid_values.h"
#include "server/session/legend.h"
#include "server/session/traced_capture.h"
#include "server/session/traced_meters.h"

namespace gonio {
namespace {

constexpr std::size_t kMostTitle = 200;
constexpr std::uint32_t kLeastSide_px = 64, kMostSide_px = 4096, kWidth_px = 960;
constexpr double kBeautyNoise = 3.0, kMeterShare = 0.25;  // of the noise of pictures

// Sets what the parts of a report have in common. Query: of a capture, a grid or an observer.
template <typename Query>
void put_settings(const v1::LuxReportQuery& query, double share, Query& part) {
    part.set_quality("reference");
    part.set_bounces(query.bounces());
    const double noise = query.has_noise_ratio() ? query.noise_ratio() : kReportNoise;
    part.set_noise_ratio(std::clamp(share * noise, kMinNoise, kMaxNoise));
    if (query.has_max_seconds()) part.set_max_seconds(query.max_seconds());
}

// The scene of the picture's layers: all light, nothing compared.
Scene pictured(const Scene& scene) {
    Scene whole = scene;
    whole.view_only.clear();
    whole.view_compare.clear();
    return whole;
}

std::optional<Error> add_pictures(const Scene& scene, const v1::LuxReportQuery& query, LuxReportRequest& request) {
    const bool own = query.width_px() == 0 && query.height_px() == 0;
    const auto side = [&](std::uint32_t asked) { return asked >= kLeastSide_px && asked <= kMostSide_px; };
    if (!own && (!side(query.width_px()) || !side(query.height_px())))
        return Error{"invalid_argument", "lux_report.width_px",
                     std::to_string(query.width_px()) + "x" + std::to_string(query.height_px()),
                     "must be 64 to 4096 a side"};
    for (const View view : {View::beauty, View::illuminance}) {
        v1::CaptureQuery capture;
        capture.set_view(view_name(view));
        capture.set_format(view == View::beauty ? "jpg" : "png");
        capture.set_denoise(view == View::beauty);
        const double high = kWidth_px * static_cast<double>(scene.height_px) / scene.width_px;
        capture.set_width_px(own ? kWidth_px : query.width_px());
        capture.set_height_px(
            own ? static_cast<std::uint32_t>(std::clamp(high, double{kLeastSide_px}, double{kMostSide_px}))
                : query.height_px());
        capture.set_legend(view == View::illuminance &&
                           std::min(capture.width_px(), capture.height_px()) >= std::uint32_t{kLeastLegend_px});
        put_settings(query, view == View::beauty ? kBeautyNoise : 1.0, capture);
        auto checked = check_capture(pictured(scene), capture);
        if (!checked) return checked.error();
        request.pictures.push_back(std::move(*checked));
    }
    return std::nullopt;
}

}  // namespace

Result<LuxReportRequest> check_lux_report(const Scene& scene, const v1::LuxReportQuery& query, std::string date) {
    LuxReportRequest request;
    const auto place = [](Error error) {  // of a part's field: the report's own
        error.where = "lux_report" + error.where.substr(std::min(error.where.size(), error.where.find('.')));
        return error;
    };
    if (query.has_noise_ratio() && !(query.noise_ratio() >= kMinNoise && query.noise_ratio() <= kMaxNoise))
        return Error{"invalid_argument", "lux_report.noise_ratio", print_number(query.noise_ratio()),
                     "must be a number from 0.0005 to 0.5"};
    if (query.title().size() > kMostTitle || shortened_text(query.title(), kMostTitle) != query.title())
        return Error{"invalid_argument", "lux_report.title", shortened_text(query.title(), kMaxNameBytes),
                     "must be UTF-8 of at most 200 bytes without control characters"};
    request.title = !query.title().empty()     ? query.title()
                    : !scene.show_name.empty() ? scene.show_name
                                               : scene.asset->name;
    request.date = std::move(date);
    if (auto refused = add_pictures(scene, query, request)) return place(std::move(*refused));
    const auto add = [&](Result<MeterRequest> meter) -> std::optional<Error> {
        if (!meter) return place(meter.error());
        request.meters.push_back(std::move(*meter));
        return std::nullopt;
    };
    for (const auto& [name, grid] : scene.grids) {
        v1::GridQuery part;
        part.set_name(name);
        part.set_plan(true);
        put_settings(query, kMeterShare, part);
        if (auto refused = add(check_grid(scene, part))) return *refused;
    }
    for (const auto& [name, observer] : scene.observers) {
        v1::UgrQuery part;
        part.set_observer(name);
        put_settings(query, kMeterShare, part);
        if (auto refused = add(check_ugr(scene, part))) return *refused;
    }
    return request;
}

v1::ServerMessage traced_report(std::shared_ptr<const trace::World> world, const Scene& scene,
                                const LuxReportRequest& request, std::stop_token stop,
                                const std::function<void(const trace::Progress&)>& each) {
    LuxReportParts parts;
    std::uint32_t done = 0;
    const auto tell = [&] {
        trace::Progress progress;
        progress.passes = ++done;
        each(progress);
    };
    const auto unheard = [](const trace::Progress&) {};
    const Scene shown = pictured(scene);
    v1::ServerMessage message;
    for (const CaptureRequest& picture : request.pictures) {
        auto traced = trace_capture(world, shown, picture, stop, unheard);
        if (!traced) return message;
        if (picture.legend) draw_legend(traced->picture, shown, picture.view);
        const auto image = encode_capture(traced->picture, picture.view, picture.format);
        if (!image) {
            *message.mutable_result() = refusal(image.error());
            return message;
        }
        parts.pictures.push_back({picture.view,
                                  std::string(reinterpret_cast<const char*>(image->data()), image->size()),
                                  picture.format == "jpg" ? "image/jpeg" : "image/png",
                                  traced->denoised_noise.value_or(traced->progress.noise), traced->progress.passes,
                                  traced->progress.noise_reached});
        tell();
    }
    for (const MeterRequest& meter : request.meters) {
        v1::ServerMessage part = meter.answer(traced_readings(*world, meter, stop, unheard));
        if (stop.stop_requested()) return message;
        if (part.has_grid_values()) parts.grids.push_back(std::move(*part.mutable_grid_values()));
        if (part.has_ugr()) parts.observers.push_back(std::move(*part.mutable_ugr()));
        tell();
    }
    v1::LuxReport& report = *message.mutable_lux_report();
    report.set_html(lux_report_html(scene, request, parts));
    report.set_scene_rev(scene.scene_rev);
    return message;
}

}  // namespace gonio
