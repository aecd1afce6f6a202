// Pictures as a display shows them: of the path tracer, and captures of the live light.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/render/renderer.h"
#include "tests/gl/flip.h"

namespace gonio::bench {

// Path-traced radiance of the scene's camera and size, rgb in cd/m² and coverage, rows from the top. samples: a pixel.
std::vector<float> traced(const Scene& scene, std::uint32_t seed, unsigned samples);
// Such values at the scene's exposure (docs/rendering.md, Display).
test::Picture shown(const std::vector<float>& values, const Scene& scene);
test::Picture shown(const CapturedPicture& still);
// Writes FOLDER/NAME.ppm and makes the folder. An empty folder: nothing.
void write_ppm(const std::string& folder, const std::string& name, const test::Picture& picture);

}  // namespace gonio::bench
