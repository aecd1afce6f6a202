#include "server/capture_file.h"

#include <algorithm>

#include "server/assets/assets.h"
#include "server/scene/apply.h"

namespace gonio {
namespace {

struct ValueFormat {
    const char* unit;
    int channels;
};

ValueFormat value_format(View view) {
    switch (view) {
        case View::illuminance:
            return {"lx", 1};
        case View::luminance:
            return {"cd/m2", 1};
        case View::mask:
            return {"cd", 1};
        case View::rsm_depth:
            return {"m", 1};
        case View::rsm_normal:
            return {"1", 3};
        case View::rsm_flux:
            return {"lm/cd", 3};
        default:
            return {"cd/m2", 3};
    }
}

// Keeps the first `channels` of each four.
template <typename T>
std::vector<T> first_channels(const std::vector<T>& rgba, int channels) {
    std::vector<T> result;
    result.reserve(rgba.size() / 4 * static_cast<std::size_t>(channels));
    for (std::size_t i = 0; i < rgba.size(); i += 4) {
        for (int k = 0; k < channels; ++k) result.push_back(rgba[i + static_cast<std::size_t>(k)]);
    }
    return result;
}

}  // namespace

Result<CaptureRequest> check_capture(const Scene& scene, const v1::CaptureQuery& query) {
    CaptureRequest request;
    request.view = scene.view;
    if (!query.view().empty() && !parse_view(query.view(), request.view)) {
        return Error{"invalid_argument", "capture.view", query.view(), "there is no view of this name"};
    }
    request.format = query.format().empty() ? "png" : query.format();
    if (request.format != "png" && request.format != "jpg" && request.format != "exr") {
        return Error{"invalid_argument", "capture.format", request.format, "must be png, jpg or exr"};
    }
    if (query.quality() != "" && query.quality() != "interactive") {
        return Error{"unsupported", "capture.quality", query.quality(), "this server captures interactive quality"};
    }
    if (query.bounces() != "" && query.bounces() != "1") {
        return Error{"unsupported", "capture.bounces", query.bounces(), "interactive quality has one bounce"};
    }
    const auto side = [](std::uint32_t asked, int own) {
        return asked == 0 ? own : static_cast<int>(std::min<std::uint32_t>(asked, 1u << 20));
    };
    request.width_px = side(query.width_px(), scene.width_px);
    request.height_px = side(query.height_px(), scene.height_px);
    if (request.width_px > 4096 || request.height_px > 4096) {
        return Error{"invalid_argument", "capture.width_px",
                     std::to_string(request.width_px) + "x" + std::to_string(request.height_px),
                     "must be 1 to 4096 a side"};
    }
    return request;
}

Result<std::vector<std::byte>> encode_capture(const CapturedPicture& picture, View view, const std::string& format) {
    if (format == "exr") {
        const ValueFormat values = value_format(view);
        return encode_exr(
            {picture.width_px, picture.height_px, values.channels, first_channels(picture.values, values.channels)},
            values.unit);
    }
    const BytePicture bytes{picture.width_px, picture.height_px, first_channels(picture.rgba8, 3)};
    return format == "jpg" ? encode_jpeg(bytes, 92) : encode_png(bytes);
}

}  // namespace gonio
