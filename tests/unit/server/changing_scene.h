// A scene that commands change, for tests of what follows its changes.
#pragma once

#include <gtest/gtest.h>

#include <functional>

#include "protocol/schema/command.pb.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"

namespace gonio::test {

class ChangingScene : public testing::Test {
protected:
    void change(const std::function<void(v1::Command&)>& fill) {
        v1::Command command;
        fill(command);
        ASSERT_TRUE(apply(scene, command, {}));
    }
    // The level of the first light.
    void dim(double ratio) {
        change([&](v1::Command& c) {
            c.mutable_set_light()->set_name(scene.lights[0].name);
            c.mutable_set_light()->set_level_ratio(ratio);
        });
    }
    Scene scene;
};

}  // namespace gonio::test
