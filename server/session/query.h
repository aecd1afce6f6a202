// What clients ask of meters and captures -> checked requests. Pure functions, any thread.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "ies/core/result.h"
#include "protocol/schema/messages.h"
#include "server/render/live_renderer.h"
#include "server/scene/calculation_grid.h"
#include "server/scene/view.h"
#include "server/trace/reference.h"

namespace gonio {

struct Scene;

// interactive: the picture's own maps and virtual point lights; rsm (meters only): the sum over all texels in double
// precision; reference: path tracing.
enum class Quality : std::uint8_t { interactive, rsm, reference };

inline constexpr int kMaxBounces = 64;  // more are asked for as "all"
inline constexpr double kMinNoise = 0.0005, kMaxNoise = 0.5;
// Where a query names none. That of pictures that are filtered leaves atrium some 24 samples a pixel.
inline constexpr double kMeterNoise = 0.005, kCaptureNoise = 0.02, kDenoiseNoise = 0.15;
inline constexpr double kMinSeconds = 0.1, kMaxSeconds = 86400.0;

struct MeterRequest {
    Quality quality = Quality::interactive;
    std::vector<trace::MeterPoint> points;  // one, or NU·NV of a grid, i fastest
    bool grid = false;
    trace::Settings settings;  // of reference
    // Readings of the points, in their order -> the answer; none: meter_message(). Any thread.
    std::function<v1::ServerMessage(std::vector<v1::MeterReading> readings)> answer;
};
// Result: the quality of a query that has no rsm, and what of the rest it has, of a GridQuery ("grid"), or a UgrQuery
// ("ugr"). Errors: as check_meter.
template <typename Query>
Result<MeterRequest> measured_request(const Query& query, const std::string& place);
// Errors: "invalid_argument" (vectors, count, bounces, noise, seconds), "too_large" (count), "unsupported" (quality;
// bounces, noise or seconds that the quality does not have).
Result<MeterRequest> check_meter(const v1::MeterQuery& query);

// Errors: "unsupported" where a sun that is on would be missing in a reading: rsm meters have no bounce of it, and the
// seed technique's none of its light.
std::optional<Error> check_sun(const Scene& scene, Quality quality);

// What a query asks for, its defaults taken from the scene.
struct CaptureRequest {
    Quality quality = Quality::interactive;
    View view = View::beauty;
    std::string format;  // "png", "jpg" or "exr"
    int width_px = 0, height_px = 0;
    trace::Settings settings;  // of reference
    bool denoise = false;
    bool legend = false;                            // draw_legend()
    unsigned samples_per_pixel = kSamplesPerPixel;  // of edges; 1: pixels are what their centres show
};
// Errors: "invalid_argument" (view, format, size of 1 to 4096 a side, bounces, noise, seconds, samples). "unsupported"
// (quality; view, bounces, noise, seconds, denoising or samples that it does not have; denoising of other
// views). Likewise a legend of other views, of values, or where there is no room, and a reference of one light or of a
// difference.
Result<CaptureRequest> check_capture(const Scene& scene, const v1::CaptureQuery& query);

}  // namespace gonio
