// PNG and JPEG bytes -> Image.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "ies/core/result.h"
#include "server/scene/scene.h"

namespace gonio {

// bytes: a whole PNG or JPEG file: 1 to 4 channels, palette, 8 or 16 bit. max_pixels: what the caller can still hold.
// Result: RGBA, 8 bit, colour as encoded in the file (sRGB), alpha straight. where: place for errors.
// Errors: "bad_image", "too_large".
Result<Image> decode_image(std::span<const std::byte> bytes, const std::string& where, std::size_t max_pixels);

}  // namespace gonio
