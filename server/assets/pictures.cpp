// Images of glTF files, and captured pictures, <-> EXR, PNG and JPEG bytes, by OpenImageIO; WebP by libwebp, because
// OpenImageIO's reader multiplies colours by alpha in 8 bit.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <webp/decode.h>

#include <algorithm>
#include <optional>
#include <string_view>

#include "server/assets/assets.h"
#include "server/assets/exr.h"
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

std::vector<ExrLayer> exr_layers_of(const FloatPicture& picture) {
    const std::vector<std::string> names =
        picture.channels == 1 ? std::vector<std::string>{"Y"} : std::vector<std::string>{"R", "G", "B"};
    std::vector<ExrLayer> layers = {{names, picture.values}};
    if (!picture.haze.empty()) layers.push_back({{"haze.R", "haze.G", "haze.B"}, picture.haze});
    return layers;
}

void add_exr_texts(ExrHeader& header, const std::string& unit, bool denoised) {
    header.texts.emplace_back("gonio:unit", unit);
    if (denoised) header.texts.emplace_back("gonio:denoised", "1");
}

Result<std::vector<std::byte>> encode_exr(const FloatPicture& picture, const std::string& unit, bool denoised,
                                          bool half) {
    if (picture.channels != 1 && picture.channels != 3) return refused("exr", "an EXR has one or three channels");
    ExrHeader header;
    add_exr_texts(header, unit, denoised);
    return encode_exr_layers(picture.width_px, picture.height_px, exr_layers_of(picture), header, half);
}

Result<std::vector<std::byte>> encode_exr_layers(int width_px, int height_px, std::span<const ExrLayer> layers,
                                                 const ExrHeader& header, bool half) {
    OIIO::ImageSpec spec(width_px, height_px, 0, half ? OIIO::TypeDesc(OIIO::TypeDesc::HALF) : OIIO::TypeFloat);
    spec.channelnames.clear();
    for (const ExrLayer& layer : layers)
        spec.channelnames.insert(spec.channelnames.end(), layer.channels.begin(), layer.channels.end());
    spec.nchannels = static_cast<int>(spec.channelnames.size());
    const auto pixels = static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px),
               channels = spec.channelnames.size();
    std::vector<float> values(pixels * channels);
    std::size_t first = 0;
    for (const ExrLayer& layer : layers) {
        const std::size_t own = layer.channels.size();
        if (layer.values.size() != pixels * own)
            return refused("exr", "the layer " + layer.channels.front() + " has another size");
        for (std::size_t i = 0; i < pixels; ++i)
            std::copy_n(&layer.values[i * own], own, &values[i * channels + first]);
        first += own;
    }
    spec.attribute("compression", "zip");
    spec.attribute("oiio:ColorSpace", "Linear");
    if (!header.date.empty()) spec.attribute("DateTime", header.date);
    for (const auto& [name, text] : header.texts) {
        if (name == "gonio:denoised")
            spec.attribute(name, 1);
        else
            spec.attribute(name, text);
    }
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

Result<ExrFile> read_exr(const std::string& path) {
    auto input = OIIO::ImageInput::open(path);
    if (!input) return refused(path, OIIO::geterror());
    const OIIO::ImageSpec& spec = input->spec();
    if (spec.width <= 0 || spec.height <= 0 || spec.width > 2 * kMaxImagePx || spec.height > 2 * kMaxImagePx ||
        spec.nchannels < 1 || spec.nchannels > 64)
        return refused(path, "the picture's size is out of range");
    ExrFile file;
    file.width_px = spec.width;
    file.height_px = spec.height;
    std::vector<float> values(spec.image_pixels());
    for (int c = 0; c < spec.nchannels; ++c) {
        if (!input->read_image(0, 0, c, c + 1, OIIO::TypeFloat, values.data())) return refused(path, input->geterror());
        file.channels[spec.channelnames[static_cast<std::size_t>(c)]] = values;
    }
    for (const auto& attribute : spec.extra_attribs) file.texts[attribute.name().string()] = attribute.get_string();
    return file;
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

Result<BytePicture> decode_picture(std::span<const std::byte> bytes, const std::string& where) {
    const Result<Image> image = decode_image(bytes, where, kMaxPicturePixels);
    if (!image) return image.error();
    BytePicture picture{image->width_px, image->height_px, {}};
    picture.rgb.reserve(image->rgba.size() / 4 * 3);
    for (std::size_t i = 0; i < image->rgba.size(); i += 4)
        picture.rgb.insert(picture.rgb.end(), &image->rgba[i], &image->rgba[i] + 3);
    return picture;
}

}  // namespace gonio
