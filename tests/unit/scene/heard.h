// A scene whose console has sent something.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include "protocol/dmx/patch.h"
#include "protocol/schema/command.pb.h"
#include "protocol/schema/console.pb.h"
#include "server/scene/apply.h"
#include "server/scene/console.h"
#include "server/scene/scene.h"

namespace gonio::test {

// Result: a scene of the asset that has heard these slots of universe 1.
inline Scene heard(const std::shared_ptr<SceneAsset>& asset, const std::vector<std::uint8_t>& levels) {
    Scene scene = scene_of(asset);
    DmxUniverse universe;
    DmxSource& source = universe.sources.emplace_back();
    source.id = 1;
    source.rank.fill(101);
    std::ranges::copy(levels, source.levels.begin());
    PatchReader reader(patch_in_force(scene));
    const auto values = reader.read({DmxProtocol::sacn, 1}, universe);
    for (const auto& refused : apply_inputs(scene, commands_of(scene, values))) EXPECT_FALSE(refused);
    return scene;
}

}  // namespace gonio::test
