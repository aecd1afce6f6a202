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

}  // namespace gonio::test
