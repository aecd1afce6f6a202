// The GL context of this executable and what most of its tests include.
#pragma once

#include <gtest/gtest.h>

#include "server/gl/context.h"
#include "server/render/renderer.h"
#include "tests/scenes/scenes.h"

namespace gonio::test {

// Made before the first test, which runs on the main thread.
const gl::Context& context();
// How this run shades direct light: --gather gl or simd on the command line.
Renderer::Gather gather();

// For what does not depend on how many surfels and links there are: which passes run, and direct light.
inline void make_coarse(Renderer& renderer) {
    renderer.set_surfels({0.06, 1000, 4000});
    renderer.set_links(128);
}

}  // namespace gonio::test
