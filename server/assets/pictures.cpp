// Images of glTF files, and captured pictures, <-> EXR, PNG and JPEG bytes, by the module server/pictures; WebP by
// libwebp, because OpenImageIO's reader multiplies colours by alpha in 8 bit.
#include <dlfcn.h>
#include <webp/decode.h>

#include <algorithm>
#include <optional>
#include <string_view>

#include "server/assets/assets.h"
#include "server/assets/exr.h"
#include "server/assets/gltf_import.h"
#include "server/assets/picture_module.h"

namespace gonio {
namespace {

// The module, opened at the first call and never closed; or why it cannot be opened.
const Result<const PictureModule*>& picture_module() {
    static const Result<const PictureModule*> opened = []() -> Result<const PictureModule*> {
        void* const library = dlopen(kPictureModuleFile, RTLD_NOW | RTLD_LOCAL);
        void* const symbol = library != nullptr ? dlsym(library, kPictureModuleSymbol) : nullptr;
        if (symbol == nullptr)
            return Error{"unsupported", kPictureModuleFile, "",
                         std::string("pictures cannot be read or written: ") + dlerror()};
        return reinterpret_cast<const PictureModule* (*)()>(symbol)();
    }();
    return opened;
}

// Result: what the module's function returns, or why there is no module.
template <typename Value, typename... Parameters, typename... Arguments>
Result<Value> by_module(Result<Value> (*PictureModule::*function)(Parameters...), Arguments&&... arguments) {
    const Result<const PictureModule*>& module = picture_module();
    if (!module) return module.error();
    return ((*module)->*function)(std::forward<Arguments>(arguments)...);
}

// The size that a JPEG's frame header says (ITU-T T.81, B.2.2); none where there is no such header before a scan.
// OpenImageIO's reader allocates all coefficients of a progressive one when it opens it.
std::optional<ImageSize> jpeg_size(std::span<const std::byte> bytes) {
    const auto byte = [&](std::size_t at) { return std::to_integer<int>(bytes[at]); };
    for (std::size_t at = 2; at + 9 <= bytes.size();) {
        const int marker = byte(at + 1);
        if (byte(at) != 0xFF || marker == 0xFF) {  // libjpeg leaves out what is no marker
            ++at;
            continue;
        }
        if (marker == 0xDA || marker == 0xD9) return std::nullopt;
        const bool frame = marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
        if (frame) return ImageSize{byte(at + 7) << 8 | byte(at + 8), byte(at + 5) << 8 | byte(at + 6)};
        const bool alone = marker == 0x01 || (marker >= 0xD0 && marker <= 0xD8);
        at += alone ? 2u : 2u + static_cast<std::size_t>(byte(at + 2) << 8 | byte(at + 3));
    }
    return std::nullopt;
}

// The size in a PNG's first chunk (ISO/IEC 15948, 11.2.2); none where that is another one.
std::optional<ImageSize> png_size(std::span<const std::byte> bytes) {
    constexpr std::size_t kHeader_bytes = 33;
    const auto number = [&](std::size_t at) {
        std::int64_t value = 0;
        for (std::size_t i = at; i < at + 4; ++i) value = value << 8 | std::to_integer<int>(bytes[i]);
        return static_cast<int>(std::min<std::int64_t>(value, INT32_MAX));
    };
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    if (text.size() < kHeader_bytes || text.substr(12, 4) != "IHDR") return std::nullopt;
    return ImageSize{number(16), number(20)};
}

std::optional<ImageSize> webp_size(std::span<const std::byte> bytes) {
    WebPBitstreamFeatures features;
    const auto* const from = reinterpret_cast<const std::uint8_t*>(bytes.data());
    if (WebPGetFeatures(from, bytes.size(), &features) != VP8_STATUS_OK || features.has_animation) return std::nullopt;
    return ImageSize{features.width, features.height};
}

enum class PictureFormat : std::uint8_t { png, jpeg, webp, other };

// The two formats of glTF 2.0 (3.8.4 "Images") and WebP, told apart by content.
PictureFormat format_of(std::span<const std::byte> bytes) {
    const std::string_view head(reinterpret_cast<const char*>(bytes.data()), std::min<std::size_t>(bytes.size(), 12));
    if (head.substr(0, 4) == "RIFF" && head.size() == 12 && head.substr(8) == "WEBP") return PictureFormat::webp;
    if (head.substr(0, 4) == "\x89PNG") return PictureFormat::png;
    return head.substr(0, 3) == "\xff\xd8\xff" ? PictureFormat::jpeg : PictureFormat::other;
}

Error unknown_format(const std::string& where) {
    return {"bad_image", where, "", "the image is neither PNG nor JPEG nor WebP"};
}

Result<Image> decode_webp(std::span<const std::byte> bytes, const std::string& where, std::size_t max_pixels) {
    const auto* const from = reinterpret_cast<const std::uint8_t*>(bytes.data());
    WebPBitstreamFeatures features;
    if (WebPGetFeatures(from, bytes.size(), &features) != VP8_STATUS_OK || features.has_animation)
        return Error{"bad_image", where, "", "the image is not a still WebP picture"};
    if (auto error = check_pixels(features.width, features.height, max_pixels, where)) return *error;
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
    if (picture.channels != 1 && picture.channels != 3)
        return Error{"bad_image", "exr", "", "an EXR has one or three channels"};
    ExrHeader header;
    add_exr_texts(header, unit, denoised);
    return encode_exr_layers(picture.width_px, picture.height_px, exr_layers_of(picture), header, half);
}

Result<std::vector<std::byte>> encode_exr_layers(int width_px, int height_px, std::span<const ExrLayer> layers,
                                                 const ExrHeader& header, bool half) {
    return by_module(&PictureModule::write_exr, width_px, height_px, layers, header, half);
}

Result<std::vector<std::byte>> encode_png(const BytePicture& picture) {
    return by_module(&PictureModule::write_png, picture);
}

Result<std::vector<std::byte>> encode_rgba_png(const Image& image) {
    return by_module(&PictureModule::write_rgba_png, image);
}

Result<std::vector<std::byte>> encode_jpeg(const BytePicture& picture, int quality_percent) {
    return by_module(&PictureModule::write_jpeg, picture, quality_percent);
}

Result<FloatPicture> read_picture(const std::string& path) {
    return by_module(&PictureModule::read_floats, path);
}

Result<ExrFile> read_exr(const std::string& path) {
    return by_module(&PictureModule::read_layers, path);
}

Result<Image> decode_image(std::span<const std::byte> bytes, const std::string& where, std::size_t max_pixels) {
    const PictureFormat format = format_of(bytes);
    if (format == PictureFormat::webp) return decode_webp(bytes, where, max_pixels);
    if (format == PictureFormat::other) return unknown_format(where);  // no other reader ever sees these bytes
    const bool png = format == PictureFormat::png, jpeg = !png;
    if (const auto said = jpeg ? jpeg_size(bytes) : std::nullopt) {
        if (auto error = check_pixels(said->width_px, said->height_px, max_pixels, where)) return *error;
    }
    return by_module(&PictureModule::decode, bytes, png, where, max_pixels);
}

Result<ImageSize> image_size(std::span<const std::byte> bytes, const std::string& where, std::size_t max_pixels) {
    const PictureFormat format = format_of(bytes);
    if (format == PictureFormat::other) return unknown_format(where);
    const auto size = format == PictureFormat::png    ? png_size(bytes)
                      : format == PictureFormat::jpeg ? jpeg_size(bytes)
                                                      : webp_size(bytes);
    if (!size || size->width_px < 1 || size->height_px < 1)
        return Error{"bad_image", where, "", "the image's header is damaged"};
    if (auto error = check_pixels(size->width_px, size->height_px, max_pixels, where)) return *error;
    return *size;
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
