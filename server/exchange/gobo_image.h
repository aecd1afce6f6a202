// Picture files -> gobos of a wheel.
#pragma once

#include <string>

#include "ies/core/result.h"
#include "server/scene/profile.h"

namespace gonio::exchange {

inline constexpr int kMostGobo_px = 256;                                         // of each side, what is kept of it
inline constexpr std::size_t kMostGoboPicturePixels = std::size_t{2048} * 2048;  // of the file

// bytes: a PNG, JPEG or WebP file, of which only the header is read: the picture is decoded when it is first shown.
// It becomes a square of transmissions: its luminance times its alpha, linear, means over what becomes one pixel.
// place: of the file, for messages. Errors: "bad_image", "too_large".
Result<Gobo> packed_gobo(std::string bytes, const std::string& place);

}  // namespace gonio::exchange
