// A captured picture -> the bytes of an image file, and the answer that carries them. Any thread.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "ies/core/result.h"
#include "protocol/schema/messages.h"
#include "server/assets/exr.h"
#include "server/render/renderer.h"

namespace gonio {

// format: "png" or "jpg" (the picture as displayed) or "exr" (values). One channel Y is in lx or cd/m² for
// `illuminance` and `luminance`, in cd for `mask`, in m for `rsm-depth`. The pictures have R G B in cd/m².
// header: what an EXR says beside its unit.
Result<std::vector<std::byte>> encode_capture(const CapturedPicture& picture, View view, const std::string& format,
                                              const ExrHeader& header = {});

// Result: the CaptureResult with such a file, or the refusal that encode_capture() gives.
v1::ServerMessage capture_message(const CapturedPicture& picture, View view, const std::string& format,
                                  Revision scene_rev);

}  // namespace gonio
