// The renderer without GL: what tests of everything around it rely on.
#include "server/session/null_renderer.h"
#include "server/scene/scene.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace gonio {
namespace {

Scene scene_at(Revision rev) {
    Scene scene;
    scene.width_px = 32;
    scene.height_px = 16;
    scene.scene_rev = rev;
    return scene;
}

TEST(NullRenderer, FramesLeaveInOrderAndTellTheirRevisionByTheirLuma) {
    NullRenderer renderer;
    renderer.begin_frame(scene_at(7), 1);
    renderer.begin_frame(scene_at(8), 2);
    EXPECT_EQ(renderer.frames_in_flight(), 2u);
    for (const Revision rev : {7u, 8u}) {
        const auto frame = renderer.finish_frame(false);
        ASSERT_TRUE(frame && frame->nv12);
        EXPECT_EQ(frame->report.scene_rev(), rev);
        ASSERT_EQ(frame->nv12->size(), 32u * 16u * 3 / 2);
        EXPECT_TRUE(std::all_of(frame->nv12->begin(), frame->nv12->begin() + 32 * 16,
                                [&](std::uint8_t luma) { return luma == NullRenderer::luma_of(rev); }));
        EXPECT_TRUE(std::all_of(frame->nv12->begin() + 32 * 16, frame->nv12->end(),
                                [](std::uint8_t chroma) { return chroma == 128; }));
    }
    EXPECT_FALSE(renderer.finish_frame(true));
    EXPECT_NE(NullRenderer::luma_of(7), NullRenderer::luma_of(8));
}

TEST(NullRenderer, AnUnchangedSceneIsCleanAndACaptureHasItsSize) {
    NullRenderer renderer;
    renderer.begin_frame(scene_at(7), 1);
    renderer.begin_frame(scene_at(7), 2);
    EXPECT_TRUE(renderer.finish_frame(true)->nv12);
    EXPECT_FALSE(renderer.finish_frame(true)->nv12);
    for (const bool raw : {false, true}) {
        const auto job = renderer.begin_capture(scene_at(9), View::beauty, 5, 3, raw);
        ASSERT_TRUE(renderer.continue_capture(*job));
        EXPECT_EQ(job->picture->rgba8.size(), raw ? 0u : 60u);
        EXPECT_EQ(job->picture->values.size(), raw ? 60u : 0u);
        EXPECT_EQ(job->picture->report.scene_rev(), 9u);
    }
}

}  // namespace
}  // namespace gonio
