// The list of passes of one frame, in order: the one page that says what runs when. Keys are the cost table of
// docs/rendering.md.
#pragma once

#include <vector>

#include "server/render/frame_inputs.h"
#include "server/render/graph.h"

namespace gonio {

// inputs outlive the passes.
std::vector<Pass> build_pipeline(const FrameInputs& inputs);

// The slots a viewer of this view looks at: NV12 for the live picture, the picture for captures, layers for meters.
std::vector<SlotRef> wanted_slots(const FrameInputs& inputs, bool nv12);

}  // namespace gonio
