// What server/pictures does for server/assets: a table of functions, since it is opened at run time. Any thread.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "server/assets/assets.h"
#include "server/assets/exr.h"

namespace gonio {

// Each as the function of assets.h or exr.h that calls it.
struct PictureModule {
    Result<std::vector<std::byte>> (*write_exr)(int width_px, int height_px, std::span<const ExrLayer> layers,
                                                const ExrHeader& header, bool half);
    Result<std::vector<std::byte>> (*write_png)(const BytePicture& picture);
    Result<std::vector<std::byte>> (*write_rgba_png)(const Image& image);
    Result<std::vector<std::byte>> (*write_jpeg)(const BytePicture& picture, int quality_percent);
    Result<FloatPicture> (*read_floats)(const std::string& path);
    Result<ExrFile> (*read_layers)(const std::string& path);
    // png: else a JPEG.
    Result<Image> (*decode)(std::span<const std::byte> bytes, bool png, const std::string& where,
                            std::size_t max_pixels);
};

// The file beside the program, or in the folder lib/gonio of where it is installed, and the function in it that returns
// the table.
inline constexpr const char* kPictureModuleFile = "libgonio-pictures.so";
inline constexpr const char* kPictureModuleSymbol = "gonio_picture_module";

// Result: why an image of this size is refused, if it is.
inline std::optional<Error> check_pixels(int width_px, int height_px, std::size_t max_pixels,
                                         const std::string& where) {
    const std::string size = std::to_string(width_px) + "x" + std::to_string(height_px);
    if (width_px <= 0 || height_px <= 0) return Error{"bad_image", where, size, "the image has no pixels"};
    if (width_px > kMaxImagePx || height_px > kMaxImagePx ||
        static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px) > max_pixels)
        return Error{"too_large", where, size, "the image, or all images together, are too large"};
    return std::nullopt;
}

}  // namespace gonio
