// Images of glTF files, and captured pictures, <-> EXR, PNG and JPEG bytes, by OpenImageIO; WebP by libwebp, because
// OpenImageIO's reader multiplies colours by alpha in 8 bit.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <webp/decode.h>

#include <algorithm>
#include <optional>
#include <string_view>

#include "server/assets/assets.h"
#include "server/assets/gltf_import.h"

namespace gonio {
namespace {

Error refused(std::string place, std::string message) {
    return Error{"bad_image", std::move(place), "", std::move(message)};
}

// format: file extension that selects the writer. pixels: width * height * channels values of pixel_type.
Result<std::vector<std::byte>> encode(const std::string& format, const OIIO::ImageSpec& spec,
                                      const OIIO::TypeDesc& pixel_type, const void* pixels, std::size_t values) {
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

// Result: why an image of this size is refused, if it is.
std::optional<Error> check_size(int width_px, int height_px, std::size_t max_pixels, const std::string& where) {
    const std::string size = std::to_string(width_px) + "x" + std::to_string(height_px);
    if (width_px <= 0 || height_px <= 0) return Error{"bad_image", where, size, "the image has no pixels"};
    if (width_px > kMaxImagePx || height_px > kMaxImagePx ||
        static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px) > max_pixels)
        return Error{"too_large", where, size, "the image, or all images together, are too large"};
    return std::nullopt;
}

struct Size {
    int width_px = 0, height_px = 0;
};

// The size that a JPEG's frame header says (ITU-T T.81, B.2.2); none where there is no such header before a scan.
// OpenImageIO's reader allocates all coefficients of a progressive one when it opens it.
std::optional<Size> jpeg_size(std::span<const std::byte> bytes) {
    const auto byte = [&](std::size_t at) { return std::to_integer<int>(bytes[at]); };
    for (std::size_t at = 2; at + 9 <= bytes.size();) {
        const int marker = byte(at + 1);
        if (byte(at) != 0xFF || marker == 0xFF) {  // libjpeg leaves out what is no marker
            ++at;
            continue;
        }
        if (marker == 0xDA || marker == 0xD9) return std::nullopt;
        const bool frame = marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
        if (frame) return Size{byte(at + 7) << 8 | byte(at + 8), byte(at + 5) << 8 | byte(at + 6)};
        const bool alone = marker == 0x01 || (marker >= 0xD0 && marker <= 0xD8);
        at += alone ? 2u : 2u + static_cast<std::size_t>(byte(at + 2) << 8 | byte(at + 3));
    }
    return std::nullopt;
}

Result<Image> decode_webp(std::span<const std::byte> bytes, const std::string& where, std::size_t max_pixels) {
    const auto* const from = reinterpret_cast<const std::uint8_t*>(bytes.data());
    WebPBitstreamFeatures features;
    if (WebPGetFeatures(from, bytes.size(), &features) != VP8_STATUS_OK || features.has_animation)
        return Error{"bad_image", where, "", "the image is not a still WebP picture"};
    if (auto error = check_size(features.width, features.height, max_pixels, where)) return *error;
    Image image;
    image.width_px = features.width;
    image.height_px = features.height;
    image.rgba.resize(std::size_t{4} * static_cast<std::size_t>(features.width) *
                      static_cast<std::size_t>(features.height));
    if (!WebPDecodeRGBAInto(from, bytes.size(), image.rgba.data(), image.rgba.size(), 4 * features.width))
        return Error{"bad_image", where, "", "the WebP image is damaged"};
    return image;
}

}  // namespace

Result<std::vector<std::byte>> encode_exr(const FloatPicture& picture, const std::string& unit, bool denoised,
                                          bool half) {
    if (picture.channels != 1 && picture.channels != 3) return refused("exr", "an EXR has one or three channels");
    const auto channels = static_cast<std::size_t>(picture.channels), pixels = picture.values.size() / channels;
    const bool haze = !picture.haze.empty();
    if (haze && picture.haze.size() != 3 * pixels) return refused("exr", "the layer haze has another size");
    OIIO::ImageSpec spec(picture.width_px, picture.height_px, picture.channels + (haze ? 3 : 0),
                         half ? OIIO::TypeDesc(OIIO::TypeDesc::HALF) : OIIO::TypeFloat);
    if (picture.channels == 1) spec.channelnames = {"Y"};
    std::vector<float> both;  // channel by channel of each pixel
    if (haze) {
        if (picture.channels == 3) spec.channelnames = {"R", "G", "B"};
        for (const char* name : {"haze.R", "haze.G", "haze.B"}) spec.channelnames.emplace_back(name);
        for (std::size_t i = 0; i < pixels; ++i) {
            both.insert(both.end(), &picture.values[i * channels], &picture.values[i * channels] + channels);
            both.insert(both.end(), &picture.haze[3 * i], &picture.haze[3 * i] + 3);
        }
    }
    const std::vector<float>& values = haze ? both : picture.values;
    spec.attribute("compression", "zip");
    spec.attribute("oiio:ColorSpace", "Linear");
    spec.attribute("gonio:unit", unit);
    if (denoised) spec.attribute("gonio:denoised", 1);
    return encode("exr", spec, OIIO::TypeFloat, values.data(), values.size());
}

Result<std::vector<std::byte>> encode_png(const BytePicture& picture) {
    OIIO::ImageSpec spec(picture.width_px, picture.height_px, 3, OIIO::TypeUInt8);
    spec.attribute("oiio:ColorSpace", "sRGB");
    return encode("png", spec, OIIO::TypeUInt8, picture.rgb.data(), picture.rgb.size());
}

Result<std::vector<std::byte>> encode_rgba_png(const Image& image) {
    OIIO::ImageSpec spec(image.width_px, image.height_px, 4, OIIO::TypeUInt8);
    spec.attribute("oiio:ColorSpace", image.linear ? "Linear" : "sRGB");
    spec.attribute("oiio:UnassociatedAlpha", 1);
    return encode("png", spec, OIIO::TypeUInt8, image.rgba.data(), image.rgba.size());
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
    const std::string_view head(reinterpret_cast<const char*>(bytes.data()), std::min<std::size_t>(bytes.size(), 12));
    if (head.substr(0, 4) == "RIFF" && head.size() == 12 && head.substr(8) == "WEBP")
        return decode_webp(bytes, where, max_pixels);
    // The two formats of glTF 2.0 (3.8.4 "Images"), told apart by content: no other reader ever sees these bytes.
    const bool png = head.substr(0, 4) == "\x89PNG", jpeg = head.substr(0, 3) == "\xff\xd8\xff";
    if (!png && !jpeg) return Error{"bad_image", where, "", "the image is neither PNG nor JPEG nor WebP"};
    if (const auto said = jpeg ? jpeg_size(bytes) : std::nullopt) {
        if (auto error = check_size(said->width_px, said->height_px, max_pixels, where)) return *error;
    }
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
    if (spec.nchannels < 1 || spec.nchannels > 4)
        return Error{"bad_image", where, size, "the image has an odd number of channels"};
    if (auto error = check_size(spec.width, spec.height, max_pixels, where)) return *error;
    const std::size_t pixels = spec.image_pixels();
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
