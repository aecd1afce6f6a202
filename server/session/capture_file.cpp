#include "server/session/capture_file.h"

#include "protocol/schema/codec.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/measure.pb.h"
#include "server/session/replies.h"

namespace gonio {
namespace {

struct ValueFormat {
    const char* unit;
    int channels;
};

ValueFormat value_format(View view) {
    struct Row {
        View view;
        ValueFormat format;
    };
    constexpr Row rows[] = {{View::illuminance, {"lx", 1}}, {View::luminance, {"cd/m2", 1}},
                            {View::mask, {"cd", 1}},        {View::rsm_depth, {"m", 1}},
                            {View::rsm_normal, {"1", 3}},   {View::rsm_flux, {"lm/cd", 3}}};
    for (const Row& row : rows)
        if (row.view == view) return row.format;
    return {"cd/m2", 3};
}

// Keeps the first `channels` of each four.
template <typename T>
std::vector<T> first_channels(const std::vector<T>& rgba, int channels) {
    std::vector<T> result;
    result.reserve(rgba.size() / 4 * static_cast<std::size_t>(channels));
    for (std::size_t i = 0; i < rgba.size(); i += 4) result.insert(result.end(), &rgba[i], &rgba[i] + channels);
    return result;
}

}  // namespace

Result<std::vector<std::byte>> encode_capture(const CapturedPicture& picture, View view, const std::string& format,
                                              const ExrHeader& header) {
    if (format == "exr") {
        const ValueFormat values = value_format(view);
        ExrHeader all = header;
        add_exr_texts(all, values.unit, picture.denoised);
        const FloatPicture floats{picture.width_px, picture.height_px, values.channels,
                                  first_channels(picture.values, values.channels), picture.haze};
        return encode_exr_layers(floats.width_px, floats.height_px, exr_layers_of(floats), all);
    }
    const BytePicture bytes{picture.width_px, picture.height_px, first_channels(picture.rgba8, 3)};
    return format == "jpg" ? encode_jpeg(bytes, 92) : encode_png(bytes);
}

v1::ServerMessage capture_message(const CapturedPicture& picture, View view, const std::string& format,
                                  Revision scene_rev) {
    const Result<std::vector<std::byte>> image = encode_capture(picture, view, format);
    if (!image) return message_of(&v1::ServerMessage::mutable_result, refusal(image.error()));
    v1::ServerMessage message;
    v1::CaptureResult& result = *message.mutable_capture();
    result.set_format(format);
    result.set_image(std::string(reinterpret_cast<const char*>(image->data()), image->size()));
    result.set_width_px(static_cast<std::uint32_t>(picture.width_px));
    result.set_height_px(static_cast<std::uint32_t>(picture.height_px));
    result.set_scene_rev(scene_rev);
    return message;
}

}  // namespace gonio
