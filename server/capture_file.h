// A capture as a client or a job asks for it, and a captured picture -> the bytes of an image file.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "ies/result.h"
#include "server/render/renderer.h"

namespace gonio {

// What a query asks for, its defaults taken from the scene.
struct CaptureRequest {
    View view = View::beauty;
    std::string format;  // "png", "jpg" or "exr"
    int width_px = 0, height_px = 0;
};
// Errors: "invalid_argument" (view, format, size of 1 to 4096 a side), "unsupported" (quality, bounces).
Result<CaptureRequest> check_capture(const Scene& scene, const v1::CaptureQuery& query);

// format: "png" or "jpg" (the picture as displayed) or "exr" (values: one channel Y in lx or cd/m² for `illuminance`
// and `luminance`, in cd for `mask`, in m for `rsm-depth`; R G B in cd/m² for the pictures). Any thread.
Result<std::vector<std::byte>> encode_capture(const CapturedPicture& picture, View view, const std::string& format);

}  // namespace gonio
