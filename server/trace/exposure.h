// Metering: the exposure at which the picture of a scene can be read. Any thread. No GL.
#pragma once

#include <optional>

#include "server/scene/view.h"

namespace gonio {
struct Scene;
}  // namespace gonio

namespace gonio::trace {

// Result: EV100 for what the scene's camera sees, with every bounce, within the range of `set exposure`; nothing where
// all is dark. The log-average luminance is shown as a key value (Reinhard et al. 2002), here 0.4 of white, as people
// expose the built-in scenes: EV100 = log2(L / (1.2 · 0.4)). It is that of the pixels from the middle to the 98th
// percentile, so that neither a dark surround nor a lamp in the picture counts. A small path-traced picture, the same
// for the same scene: some 50 ms of this thread.
std::optional<double> metered_ev100(const Scene& scene);

// Result: the upper end of a scale for the view illuminance, lx, or luminance, cd/m². It is 1, 2 or 5 times a power of
// ten, and 99 % of such a picture lie below; nothing where it is dark. It takes as long. Any thread.
std::optional<double> metered_range(const Scene& scene, View view);

}  // namespace gonio::trace
