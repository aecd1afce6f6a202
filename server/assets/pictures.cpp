// Images of glTF files, and captured pictures, <-> EXR, PNG and JPEG bytes, by OpenImageIO.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <string_view>

#include "server/assets/assets.h"
#include "server/assets/gltf_import.h"

namespace gonio {
namespace {

Error refused(std::string place, std::string message) {
    return Error{"bad_image", std::move(place), "", std::move(message)};
}

// format: file extension that selects the writer. pixels: width * height * channels values of pixel_type.
Result<std::vector<std::byte>> encode(const std::string& format, const OIIO::ImageSpec& spec, OIIO::TypeDesc pixel_type,
                                      const void* pixels, std::size_t values) {
    if (spec.width <= 0 || spec.height <= 0 || values != spec.image_pixels() * spec.nchannels) {
        return refused(format, "the picture's size and its number of values do not agree");
    }
    std::vector<unsigned char> bytes;
    OIIO::Filesystem::IOVecOutput sink(bytes);
    const std::string name = "picture." + format;
    auto output = OIIO::ImageOutput::create(name);
    if (!output || !output->supports("ioproxy")) return refused(format, "this format cannot be written to memory");
    output->set_ioproxy(&sink);
    if (!output->open(name, spec) || !output->write_image(pixel_type, pixels) || !output->close()) {
        return refused(format, output->geterror());
    }
    const auto* first = reinterpret_cast<const std::byte*>(bytes.data());
    return std::vector<std::byte>(first, first + bytes.size());
}

}  // namespace

Result<std::vector<std::byte>> encode_exr(const FloatPicture& picture, const std::string& unit, bool denoised) {
    if (picture.channels != 1 && picture.channels != 3) return refused("exr", "an EXR has one or three channels");
    OIIO::ImageSpec spec(picture.width_px, picture.height_px, picture.channels, OIIO::TypeFloat);
    if (picture.channels == 1) spec.channelnames = {"Y"};
    spec.attribute("compression", "zip");
    spec.attribute("oiio:ColorSpace", "Linear");
    spec.attribute("gonio:unit", unit);
    if (denoised) spec.attribute("gonio:denoised", 1);
    return encode("exr", spec, OIIO::TypeFloat, picture.values.data(), picture.values.size());
}

Result<std::vector<std::byte>> encode_png(const BytePicture& picture) {
    OIIO::ImageSpec spec(picture.width_px, picture.height_px, 3, OIIO::TypeUInt8);
    spec.attribute("oiio:ColorSpace", "sRGB");
    return encode("png", spec, OIIO::TypeUInt8, picture.rgb.data(), picture.rgb.size());
}

Result<std::vector<std::byte>> encode_jpeg(const BytePicture& picture, int quality_percent) {
    OIIO::ImageSpec spec(picture.width_px, picture.height_px, 3, OIIO::TypeUInt8);
    spec.attribute("compression", "jpeg:" + std::to_string(quality_percent));
    spec.attribute("oiio:ColorSpace", "sRGB");
    return encode("jpg", spec, OIIO::TypeUInt8, picture.rgb.data(), picture.rgb.size());
}

Result<FloatPicture> read_picture(const std::string& path) {
    auto input = OIIO::ImageInput::open(path);
    if (!input) return refused(path, OIIO::geterror());
    const OIIO::ImageSpec& spec = input->spec();
    if (spec.width <= 0 || spec.height <= 0 || spec.width > 2 * kMaxImagePx || spec.height > 2 * kMaxImagePx) {
        return refused(path, "the picture's size is out of range");
    }
    FloatPicture picture;
    picture.width_px = spec.width;
    picture.height_px = spec.height;
    picture.channels = spec.nchannels >= 3 ? 3 : 1;
    picture.values.resize(spec.image_pixels() * picture.channels);
    if (!input->read_image(0, 0, 0, picture.channels, OIIO::TypeFloat, picture.values.data())) {
        return refused(path, input->geterror());
    }
    return picture;
}

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
    const std::size_t pixels = spec.image_pixels();
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
