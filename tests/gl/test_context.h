// The GL context of this executable and what most of its tests include.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string_view>

#include "server/assets/assets.h"
#include "server/gl/context.h"
#include "server/render/renderer.h"
#include "tests/scenes/scenes.h"
#include "tests/scenes/show.h"

namespace gonio::test {

// Made before the first test, which runs on the main thread.
const gl::Context& context();
// How this run shades direct light: --direct-light gl or rays on the command line.
Renderer::DirectLight direct_light();

// The built-in scenes with luminaires as points, the same asset each time: a renderer takes the surfels and links of
// the one before.
inline const std::shared_ptr<const SceneAsset>& builtin(std::string_view name) {
    static const std::shared_ptr<const SceneAsset> cornell = of_points(*make_cornell()),
                                                   atrium = of_points(*make_atrium());
    return name == "cornell" ? cornell : atrium;
}

}  // namespace gonio::test
