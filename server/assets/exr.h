// EXR files with layers and a header, and pictures read back. Any thread.
#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "ies/core/result.h"
#include "server/assets/assets.h"

namespace gonio {

// What an EXR says beside its pixels.
struct ExrHeader {
    std::vector<std::pair<std::string, std::string>> texts;  // attributes by name: {"gonio:unit", "lx"}
    std::string date;  // of DateTime, "2026:02:28 12:00:00"; empty: now, so that no two files are the same
};
struct ExrLayer {
    std::vector<std::string> channels;  // {"R", "G", "B"}, {"depth.Z"}
    std::vector<float> values;          // channel by channel of each pixel
};
// Result: the bytes of a file with one part that has the channels of all layers, as 32-bit floats, or halves. Errors:
// "bad_image" where a layer has another size.
Result<std::vector<std::byte>> encode_exr_layers(int width_px, int height_px, std::span<const ExrLayer> layers,
                                                 const ExrHeader& header, bool half = false);
// Result: the layers and the header of a picture: channels Y or R, G, B, its haze, "gonio:unit", "gonio:denoised".
std::vector<ExrLayer> exr_layers_of(const FloatPicture& picture);
void add_exr_texts(ExrHeader& header, const std::string& unit, bool denoised);

// Result: all channels of an EXR by name, and the texts of its header. Errors: "bad_image".
struct ExrFile {
    int width_px = 0, height_px = 0;
    std::map<std::string, std::vector<float>> channels;
    std::map<std::string, std::string> texts;
};
Result<ExrFile> read_exr(const std::string& path);

inline constexpr std::size_t kMaxPicturePixels = std::size_t{1} << 24;
// Result: the colours of a PNG or JPEG file of at most kMaxPicturePixels. Errors: "bad_image", "too_large".
Result<BytePicture> decode_picture(std::span<const std::byte> bytes, const std::string& where);

}  // namespace gonio
