// Captured pictures <-> EXR, PNG and JPEG bytes, by OpenImageIO.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include "server/assets/assets.h"

namespace gonio {
namespace {

Error refused(std::string place, std::string message) {
    return Error{"bad_image", std::move(place), "", std::move(message)};
}

// format: file extension that selects the writer. pixels: width * height * channels values of pixel_type.
Result<std::vector<std::byte>> encode(const std::string& format, const OIIO::ImageSpec& spec, OIIO::TypeDesc pixel_type,
                                      const void* pixels, std::size_t values) {
    const auto needed = static_cast<std::size_t>(spec.width) * static_cast<std::size_t>(spec.height) *
                        static_cast<std::size_t>(spec.nchannels);
    if (spec.width <= 0 || spec.height <= 0 || values != needed) {
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

Result<std::vector<std::byte>> encode_exr(const FloatPicture& picture, const std::string& unit) {
    if (picture.channels != 1 && picture.channels != 3) return refused("exr", "an EXR has one or three channels");
    OIIO::ImageSpec spec(picture.width_px, picture.height_px, picture.channels, OIIO::TypeFloat);
    if (picture.channels == 1) spec.channelnames = {"Y"};
    spec.attribute("compression", "zip");
    spec.attribute("oiio:ColorSpace", "Linear");
    spec.attribute("gonio:unit", unit);
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
    picture.values.resize(static_cast<std::size_t>(spec.width) * static_cast<std::size_t>(spec.height) *
                          static_cast<std::size_t>(picture.channels));
    if (!input->read_image(0, 0, 0, picture.channels, OIIO::TypeFloat, picture.values.data())) {
        return refused(path, input->geterror());
    }
    return picture;
}

}  // namespace gonio
