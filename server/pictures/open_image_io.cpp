// Picture files by OpenImageIO. A module, since OpenImageIO brings some 140 other libraries, which take 0.2 s to load:
// server/assets/pictures.cpp opens it with the first picture.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <string>
#include <vector>

#include "server/assets/picture_module.h"

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

Result<std::vector<std::byte>> write_exr(int width_px, int height_px, std::span<const ExrLayer> layers,
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

Result<std::vector<std::byte>> write_png(const BytePicture& picture) {
    OIIO::ImageSpec spec(picture.width_px, picture.height_px, 3, OIIO::TypeUInt8);
    spec.attribute("oiio:ColorSpace", "sRGB");
    return encode("png", spec, OIIO::TypeUInt8, picture.rgb.data(), picture.rgb.size());
}

Result<std::vector<std::byte>> write_rgba_png(const Image& image) {
    OIIO::ImageSpec spec(image.width_px, image.height_px, 4, OIIO::TypeUInt8);
    spec.attribute("oiio:ColorSpace", image.linear ? "Linear" : "sRGB");
    spec.attribute("oiio:UnassociatedAlpha", 1);
    return encode("png", spec, OIIO::TypeUInt8, image.rgba.data(), image.rgba.size());
}

Result<std::vector<std::byte>> write_jpeg(const BytePicture& picture, int quality_percent) {
    OIIO::ImageSpec spec(picture.width_px, picture.height_px, 3, OIIO::TypeUInt8);
    spec.attribute("compression", "jpeg:" + std::to_string(quality_percent));
    spec.attribute("oiio:ColorSpace", "sRGB");
    return encode("jpg", spec, OIIO::TypeUInt8, picture.rgb.data(), picture.rgb.size());
}

Result<FloatPicture> read_floats(const std::string& path) {
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

Result<ExrFile> read_layers(const std::string& path) {
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

// png: else a JPEG.
Result<Image> decode(std::span<const std::byte> bytes, bool png, const std::string& where, std::size_t max_pixels) {
    OIIO::Filesystem::IOMemReader source(const_cast<std::byte*>(bytes.data()), bytes.size());
    OIIO::ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1);
    const auto input = OIIO::ImageInput::create(png ? "png" : "jpeg");
    // Its place is no image's: no other image could be read either, so the scene is refused.
    if (!input)
        return Error{"unsupported", "OpenImageIO", png ? "PNG" : "JPEG", "OpenImageIO was built without this format"};
    input->set_ioproxy(&source);
    OIIO::ImageSpec spec;
    if (!input->open(png ? "image.png" : "image.jpg", spec, config)) {
        return Error{"bad_image", where, "", "the image cannot be decoded: " + input->geterror()};
    }
    const std::string size = std::to_string(spec.width) + "x" + std::to_string(spec.height);
    if (spec.nchannels < 1 || spec.nchannels > 4)
        return Error{"bad_image", where, size, "the image has an odd number of channels"};
    if (auto error = check_pixels(spec.width, spec.height, max_pixels, where)) return *error;
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

constexpr PictureModule kModule = {write_exr, write_png, write_rgba_png, write_jpeg, read_floats, read_layers, decode};

}  // namespace
}  // namespace gonio

extern "C" __attribute__((visibility("default"))) const gonio::PictureModule* gonio_picture_module() {
    return &gonio::kModule;
}
