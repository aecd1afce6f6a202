// Input profiles of QLC+ (.qxi, http://www.qlcplus.org/InputProfile). Pure; pugixml stays in the .cpp file.
#pragma once

#include <string_view>

#include "ies/core/result.h"
#include "protocol/surface/surface_profile.h"

namespace gonio {

// Result: the MIDI surface that the file describes, in full resolution: QLC+ itself keeps 8 bits. Sliders drive the
// scene's lights in their order; buttons and knobs nothing; page buttons turn pages. Errors: "bad_surface" with the
// channel as place; "unsupported" for profiles of OSC, HID and other inputs; "too_large".
Result<SurfaceProfile> read_qxi(std::string_view text);

}  // namespace gonio
