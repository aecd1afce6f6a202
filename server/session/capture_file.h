// A captured picture -> the bytes of an image file.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "ies/core/result.h"
#include "server/render/renderer.h"

namespace gonio {

// format: "png" or "jpg" (the picture as displayed) or "exr" (values). One channel Y is in lx or cd/m² for
// `illuminance` and `luminance`, in cd for `mask`, in m for `rsm-depth`. The pictures have R G B in cd/m². Any thread.
Result<std::vector<std::byte>> encode_capture(const CapturedPicture& picture, View view, const std::string& format);

}  // namespace gonio
