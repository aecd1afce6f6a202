#include "server/assets/image_file.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <string_view>

#include "server/assets/assets.h"

namespace gonio {

Result<Image> decode_image(std::span<const std::byte> bytes, const std::string& where, std::size_t max_pixels) {
    const std::string_view head(reinterpret_cast<const char*>(bytes.data()), std::min<std::size_t>(bytes.size(), 8));
    // The two formats of glTF 2.0 (3.8.4 "Images"), told apart by content: no other reader ever sees these bytes.
    const bool png = head.substr(0, 4) == "\x89PNG", jpeg = head.substr(0, 3) == "\xff\xd8\xff";
    if (!png && !jpeg) return Error{"bad_image", where, "", "the image is neither PNG nor JPEG"};
    OIIO::Filesystem::IOMemReader source(const_cast<std::byte*>(bytes.data()), bytes.size());
    OIIO::ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1);
    const auto input = OIIO::ImageInput::create(png ? "png" : "jpeg");
    if (!input) return Error{"unsupported", where, png ? "PNG" : "JPEG", "OpenImageIO was built without this format"};
    input->set_ioproxy(&source);
    OIIO::ImageSpec spec;
    if (!input->open(png ? "image.png" : "image.jpg", spec, config)) {
        return Error{"bad_image", where, "", "the image cannot be decoded: " + input->geterror()};
    }
    const std::string size = std::to_string(spec.width) + "x" + std::to_string(spec.height);
    if (spec.width <= 0 || spec.height <= 0 || spec.nchannels < 1 || spec.nchannels > 4) {
        return Error{"bad_image", where, size, "the image has no pixels or an odd number of channels"};
    }
    const auto pixels = static_cast<std::size_t>(spec.width) * static_cast<std::size_t>(spec.height);
    if (spec.width > kMaxImagePx || spec.height > kMaxImagePx || pixels > max_pixels) {
        return Error{"too_large", where, size, "the image, or all images together, are too large"};
    }
    const auto channels = static_cast<std::size_t>(spec.nchannels);
    std::vector<std::uint8_t> read(pixels * channels);
    if (!input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeUInt8, read.data())) {
        return Error{"bad_image", where, size, "the image cannot be decoded: " + input->geterror()};
    }
    Image image;
    image.width_px = spec.width;
    image.height_px = spec.height;
    image.rgba.resize(pixels * 4);
    for (std::size_t i = 0; i < pixels; ++i) {
        const std::uint8_t* from = &read[i * channels];
        std::uint8_t* to = &image.rgba[i * 4];
        const bool grey = channels < 3;
        to[0] = from[0];
        to[1] = grey ? from[0] : from[1];
        to[2] = grey ? from[0] : from[2];
        to[3] = channels == 2 ? from[1] : channels == 4 ? from[3] : std::uint8_t{255};
    }
    return image;
}

}  // namespace gonio
