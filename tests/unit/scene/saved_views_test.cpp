// Saved views of the camera: kept, recalled, removed; what is refused changes nothing; what a scene keeps of them.
#include <gtest/gtest.h>

#include <functional>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "server/scene/state.h"

namespace gonio {
namespace {

std::shared_ptr<const SceneAsset> asset_named(const char* name) {
    auto asset = std::make_shared<SceneAsset>();
    asset->name = name;
    asset->bounds = {{-1, -1, -1}, {1, 1, 1}};
    return asset;
}

class SavedViews : public testing::Test {
protected:
    std::string run(const std::function<void(v1::Command&)>& fill, const Loaded& loaded = {}) {
        v1::Command command;
        fill(command);
        const auto applied = apply(scene, command, loaded);
        return applied ? "ok" : applied.error().code + " " + applied.error().where;
    }
    std::string save(const std::string& name) {
        return run([&](v1::Command& c) { c.mutable_save_view()->set_name(name); });
    }
    std::string recall(const std::string& name) {
        return run([&](v1::Command& c) { c.mutable_recall_view()->set_name(name); });
    }
    std::string remove(const std::string& name) {
        return run([&](v1::Command& c) { c.mutable_remove_view()->set_name(name); });
    }
    std::string move(double x) {
        return run([&](v1::Command& c) {
            for (const double number : {x, 2.0, 3.0}) c.mutable_set_camera()->add_eye_m(number);
            c.mutable_set_camera()->set_fov_rad(0.5);
        });
    }
    std::string text() const { return full_state(scene).SerializeAsString(); }
    Scene scene = scene_of(asset_named("room"));
};

TEST_F(SavedViews, ARecallBringsTheCameraBack) {
    ASSERT_EQ(move(4), "ok");
    const Camera kept = scene.camera;
    ASSERT_EQ(save("door"), "ok");
    ASSERT_EQ(move(-7), "ok");
    const Revision before = scene.camera_rev;
    ASSERT_EQ(recall("door"), "ok");
    EXPECT_EQ(scene.camera.eye, kept.eye);
    EXPECT_EQ(scene.camera.target, kept.target);
    EXPECT_EQ(scene.camera.fov_rad, kept.fov_rad);
    EXPECT_GT(scene.camera_rev, before);
    const Revision rests = scene.scene_rev;
    ASSERT_EQ(recall("door"), "ok");
    EXPECT_EQ(scene.scene_rev, rests) << "it is there already";
}

TEST_F(SavedViews, APlaceIsKeptWithoutMovingTheCamera) {
    const Revision before = scene.camera_rev;
    ASSERT_EQ(run([](v1::Command& c) {
                  c.mutable_save_view()->set_name("above");
                  for (const double number : {0.0, 9.0, 0.01}) c.mutable_save_view()->add_eye_m(number);
              }),
              "ok");
    EXPECT_EQ(scene.camera_rev, before);
    EXPECT_EQ(scene.saved_views.at("above").eye, glm::dvec3(0, 9, 0.01));
    EXPECT_EQ(scene.saved_views.at("above").target, scene.camera.target);
    EXPECT_EQ(scene.saved_views.at("above").fov_rad, scene.camera.fov_rad);
}

TEST_F(SavedViews, TheStateTellsThemByName) {
    ASSERT_EQ(save("b"), "ok");
    ASSERT_EQ(save("a"), "ok");
    const v1::State state = full_state(scene);
    ASSERT_EQ(state.saved_views().views_size(), 2);
    EXPECT_EQ(state.saved_views().views(0).name(), "a");
    EXPECT_EQ(state.saved_views().views(0).camera().eye(2), scene.camera.eye.z);
    ASSERT_EQ(remove("a"), "ok");
    ASSERT_EQ(remove("b"), "ok");
    EXPECT_TRUE(full_state(scene).has_saved_views()) << "that there is none is told too";
    EXPECT_EQ(full_state(scene).saved_views().views_size(), 0);
}

// So that a client can place the camera around all of it.
TEST_F(SavedViews, TheStateTellsHowLargeTheSceneIs) {
    const v1::State state = full_state(scene);
    ASSERT_EQ(state.bounds().min_m_size(), 3);
    ASSERT_EQ(state.bounds().max_m_size(), 3);
    for (int i = 0; i < 3; ++i) {
        EXPECT_EQ(state.bounds().min_m(i), -1);
        EXPECT_EQ(state.bounds().max_m(i), 1);
    }
}

TEST_F(SavedViews, WhatIsRefusedChangesNothing) {
    for (int i = 0; i < 64; ++i) ASSERT_EQ(save("view " + std::to_string(i)), "ok");
    const std::string before = text();
    EXPECT_EQ(save("one more"), "too_many_views save_view.name");
    EXPECT_EQ(save(""), "invalid_argument save_view.name");
    EXPECT_EQ(recall("none"), "not_found recall_view.name");
    EXPECT_EQ(remove("none"), "not_found remove_view.name");
    EXPECT_EQ(run([](v1::Command& c) {
                  c.mutable_save_view()->set_name("view 1");
                  c.mutable_save_view()->set_fov_rad(4);
              }),
              "invalid_argument save_view.fov_rad");
    EXPECT_EQ(run([](v1::Command& c) {
                  c.mutable_save_view()->set_name("view 1");
                  c.mutable_save_view()->add_eye_m(4);
              }),
              "invalid_argument save_view.eye_m");
    EXPECT_EQ(text(), before);
    EXPECT_EQ(save("view 63"), "ok") << "a name that is taken is written over";
}

TEST_F(SavedViews, TheyStayWithTheirScene) {
    ASSERT_EQ(save("door"), "ok");
    const auto load = [&](const char* name) {
        return run([](v1::Command& c) { c.mutable_load_scene()->set_file("x"); }, {.asset = asset_named(name)});
    };
    ASSERT_EQ(load("room"), "ok");
    EXPECT_TRUE(scene.saved_views.contains("door")) << "the file was written anew";
    ASSERT_EQ(load("hall"), "ok");
    EXPECT_TRUE(scene.saved_views.empty());
}

}  // namespace
}  // namespace gonio
