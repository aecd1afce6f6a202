// Every texture and the VPL list of the pipeline, read back right after the pass that wrote it: for checks, never for
// frames.
#pragma once

#include <functional>
#include <span>

#include "server/render/frame_inputs.h"

namespace gonio {

// One texture (all layers, level 0) or the VPL list. Valid during the visit only.
struct Inspected {
    const Scene& scene;
    const Light* light = nullptr;    // whose map or layer it is; null: of the target
    const LightGpu* maps = nullptr;  // likewise
    SlotRef slot;
    const char* name = "";    // as the texture's member is called: "radial_depth", "direct", "vpl_area", ...
    int channels = 4;         // per texel in `values`
    bool has_sign = false;    // directions and positions; everything else is an amount that is never negative
    bool half_float = false;  // 65,504 at most, 11 bits from 6e-5 on
    float unit = 1.0f;        // of values, lux per candela of peak: of surfels only
    std::span<const float> values;
};
using Inspector = std::function<void(const Inspected&)>;

// Reads back what the pass that writes this slot has just written and visits it. Render thread.
void inspect_slot(const FrameInputs& inputs, const SlotRef& slot, const Inspector& visit);

}  // namespace gonio
