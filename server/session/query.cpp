#include "server/session/query.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "protocol/schema/grid.pb.h"
#include "protocol/schema/measure.pb.h"
#include "server/scene/apply.h"
#include "server/scene/apply_checks.h"
#include "server/scene/false_color.h"
#include "server/scene/scene.h"
#include "server/session/legend.h"

namespace gonio {
namespace {

Error bad_argument(std::string where, std::string value, std::string message) {
    return {"invalid_argument", std::move(where), std::move(value), std::move(message)};
}

constexpr double kMaxCoordinateM = 1e6;  // as of positions in the scene

Result<glm::dvec3> vector_of(const google::protobuf::RepeatedField<double>& field, const std::string& where) {
    const bool finite =
        std::all_of(field.begin(), field.end(), [](double x) { return std::abs(x) <= kMaxCoordinateM; });
    if (field.size() != 3 || !finite)
        return bad_argument(where, print_all(field), "must be three finite numbers of at most 1e6");
    return glm::dvec3(field[0], field[1], field[2]);
}

// Result: what a reference query sets, or that the quality has none of it. Query: MeterQuery or CaptureQuery.
template <typename Query>
Result<trace::Settings> settings_of(const Query& query, Quality quality, const std::string& place, double noise) {
    trace::Settings settings;
    settings.noise = query.has_noise_ratio() ? query.noise_ratio() : noise;
    const std::string& bounces = query.bounces();
    if (quality != Quality::reference) {
        const bool one = quality == Quality::rsm;
        if (bounces == "1" || (one && bounces.empty())) {
            settings.bounces = 1;
        } else if (bounces == "0" && !one) {
            settings.bounces = 0;
        } else if (!bounces.empty() && (one || bounces != "all")) {
            return Error{"unsupported", place + ".bounces", bounces,
                         one ? "this quality has one bounce" : "this quality has 0, 1 or all bounces"};
        }
        if (query.has_noise_ratio()) {
            return Error{"unsupported", place + ".noise_ratio", print_number(query.noise_ratio()),
                         "only reference quality works towards a noise"};
        }
        if (query.has_max_seconds()) {
            return Error{"unsupported", place + ".max_seconds", print_number(query.max_seconds()),
                         "only reference quality works towards a noise"};
        }
        return settings;
    }
    if (!bounces.empty() && bounces != "all") {
        const auto [end, error] = std::from_chars(bounces.data(), bounces.data() + bounces.size(), settings.bounces);
        if (error != std::errc() || end != bounces.data() + bounces.size() || settings.bounces < 0 ||
            settings.bounces > kMaxBounces) {
            return bad_argument(place + ".bounces", bounces, "must be all or a whole number from 0 to 64");
        }
    }
    if (!(settings.noise >= kMinNoise && settings.noise <= kMaxNoise)) {
        return bad_argument(place + ".noise_ratio", print_number(settings.noise),
                            "must be a number from 0.0005 to 0.5");
    }
    if (query.has_max_seconds()) {
        settings.max_seconds = query.max_seconds();
        if (!(settings.max_seconds >= kMinSeconds && settings.max_seconds <= kMaxSeconds)) {
            return bad_argument(place + ".max_seconds", print_number(settings.max_seconds),
                                "must be a number from 0.1 to 86400");
        }
    }
    return settings;
}

// Appends the cell centres of the grid that the query asks for. Errors: as check_meter.
Result<bool> add_grid(const v1::MeterQuery& query, const trace::MeterPoint& corner,
                      std::vector<trace::MeterPoint>& points) {
    const auto& count = query.count();
    if (count.size() != 2 || count[0] == 0 || count[1] == 0)
        return bad_argument("meter.count", print_all(count), "must be two whole numbers of at least 1");
    if (static_cast<std::uint64_t>(count[0]) * count[1] > kMaxGridPoints)
        return Error{"too_large", "meter.count", print_all(count), "a grid may have at most 4096 points"};
    const auto u = vector_of(query.u_m(), "meter.u_m");
    if (!u) return u.error();
    const auto v = vector_of(query.v_m(), "meter.v_m");
    if (!v) return v.error();
    for (const auto& [edge, many, name] : {std::tuple(*u, count[0] > 1, "u_m"), {*v, count[1] > 1, "v_m"}}) {
        if (many && glm::length(edge) < 1e-9)
            return bad_argument(std::string("meter.") + name, "0,0,0", "must not be the zero vector");
    }
    for (std::uint32_t j = 0; j < count[1]; ++j) {
        for (std::uint32_t i = 0; i < count[0]; ++i)
            points.push_back({corner.position + (i + 0.5) / count[0] * *u + (j + 0.5) / count[1] * *v, corner.normal});
    }
    return true;
}

std::optional<Error> legend_refused(const CaptureRequest& request) {
    if (!request.legend) return std::nullopt;
    if (!is_false_color(request.view))
        return Error{"unsupported", "capture.legend", view_name(request.view),
                     "only illuminance and luminance have a scale of colours"};
    if (request.format == "exr")
        return Error{"unsupported", "capture.legend", request.format, "a file of values has no colours"};
    if (std::min(request.width_px, request.height_px) < kLeastLegend_px)
        return Error{"unsupported", "capture.legend",
                     std::to_string(request.width_px) + "x" + std::to_string(request.height_px),
                     "there is room for it from 160 pixels a side on"};
    return std::nullopt;
}

}  // namespace

template <typename Query>
Result<MeterRequest> measured_request(const Query& query, const std::string& place) {
    MeterRequest request;
    if (query.quality() == "reference") {
        request.quality = Quality::reference;
    } else if (!query.quality().empty() && query.quality() != "interactive") {
        return Error{"unsupported", place + ".quality", query.quality(), "must be interactive or reference"};
    }
    const auto settings = settings_of(query, request.quality, place, kMeterNoise);
    if (!settings) return settings.error();
    request.settings = *settings;
    return request;
}
template Result<MeterRequest> measured_request(const v1::GridQuery& query, const std::string& place);
template Result<MeterRequest> measured_request(const v1::UgrQuery& query, const std::string& place);

Result<MeterRequest> check_meter(const v1::MeterQuery& query) {
    MeterRequest request;
    const auto point = vector_of(query.point_m(), "meter.point_m");
    if (!point) return point.error();
    const auto normal = vector_of(query.normal(), "meter.normal");
    if (!normal) return normal.error();
    if (glm::length(*normal) < 1e-9) return bad_argument("meter.normal", "0,0,0", "must not be the zero vector");
    if (query.quality() == "rsm") {
        request.quality = Quality::rsm;
    } else if (query.quality() == "reference") {
        request.quality = Quality::reference;
    } else if (!query.quality().empty() && query.quality() != "interactive") {
        return Error{"unsupported", "meter.quality", query.quality(),
                     "this server meters interactive, rsm and reference"};
    }
    const auto settings = settings_of(query, request.quality, "meter", kMeterNoise);
    if (!settings) return settings.error();
    request.settings = *settings;
    const trace::MeterPoint first{*point, glm::normalize(*normal)};
    request.grid = query.count_size() > 0;
    if (request.grid) {
        const auto added = add_grid(query, first, request.points);
        if (!added) return added.error();
    } else if (query.u_m_size() > 0 || query.v_m_size() > 0) {
        return bad_argument("meter.count", "", "must say how many points lie along u_m and v_m");
    } else {
        request.points = {first};
    }
    return request;
}

std::optional<Error> check_sun(const Scene& scene, Quality quality) {
    const bool maps = quality == Quality::rsm, seed = scene.technique != Technique::standard;
    if (quality == Quality::reference || !(maps || seed)) return std::nullopt;
    for (const Light& light : scene.lights) {
        if (!light.sun || light_weight(scene, light) == glm::dvec3(0.0)) continue;
        return Error{"unsupported", maps ? "meter.quality" : "technique",
                     maps ? "rsm" : technique_name(scene.technique),
                     "the light '" + light.name + "' is a sun, " +
                         (maps ? "of which no reflective shadow map is made" : "which this technique does not have") +
                         "; quality reference has it" + (seed ? "" : ", and interactive")};
    }
    return std::nullopt;
}

Result<CaptureRequest> check_capture(const Scene& scene, const v1::CaptureQuery& query) {
    CaptureRequest request;
    request.view = scene.view;
    if (!query.view().empty() && !parse_view(query.view(), request.view)) {
        return bad_argument("capture.view", query.view(), "there is no view of this name");
    }
    request.format = query.format().empty() ? "png" : query.format();
    if (request.format != "png" && request.format != "jpg" && request.format != "exr") {
        return bad_argument("capture.format", request.format,
                            "must be png, jpg or exr, or of the scene's file glb or mvr");
    }
    if (query.quality() == "reference") {
        request.quality = Quality::reference;
    } else if (!query.quality().empty() && query.quality() != "interactive") {
        return Error{"unsupported", "capture.quality", query.quality(),
                     "this server captures interactive and reference"};
    }
    if (request.quality == Quality::reference && request.view > View::luminance) {
        return Error{"unsupported", "capture.view", view_name(request.view),
                     "reference quality has beauty, direct, indirect, illuminance and luminance"};
    }
    request.denoise = query.denoise();
    if (request.denoise && request.quality != Quality::reference)
        return Error{"unsupported", "capture.denoise", "true", "only reference quality is denoised"};
    if (request.denoise && request.view != View::beauty) {
        return Error{"unsupported", "capture.denoise", view_name(request.view),
                     "only the view beauty is denoised: a filter changes what others measure"};
    }
    const auto settings =
        settings_of(query, request.quality, "capture", request.denoise ? kDenoiseNoise : kCaptureNoise);
    if (!settings) return settings.error();
    request.settings = *settings;
    if (query.has_samples_per_pixel()) {
        request.samples_per_pixel = query.samples_per_pixel();
        const std::string value = std::to_string(request.samples_per_pixel);
        if (request.samples_per_pixel < 1 || request.samples_per_pixel > kMostSamplesPerPixel)
            return bad_argument("capture.samples_per_pixel", value, "must be a whole number from 1 to 64");
        if (request.quality == Quality::reference && request.samples_per_pixel != 1)
            return Error{"unsupported", "capture.samples_per_pixel", value,
                         "reference quality takes as many as its noise asks for, or 1: centres of pixels"};
    }
    const auto side = [](std::uint32_t asked, int own) {
        return asked == 0 ? own : static_cast<int>(std::min<std::uint32_t>(asked, 1u << 20));
    };
    request.width_px = side(query.width_px(), scene.width_px);
    request.height_px = side(query.height_px(), scene.height_px);
    if (request.width_px > 4096 || request.height_px > 4096) {
        return bad_argument("capture.width_px",
                            std::to_string(request.width_px) + "x" + std::to_string(request.height_px),
                            "must be 1 to 4096 a side");
    }
    request.legend = query.legend();
    if (const auto refused = legend_refused(request)) return *refused;
    return request;
}

}  // namespace gonio
