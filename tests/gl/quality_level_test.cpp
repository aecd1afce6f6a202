// Efforts (--target-fps): less while something moves, all of it afterwards.
#include "server/render/quality_level.h"
#include <set>
#include <string>

#include "server/assets/assets.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "tests/gl/test_context.h"
#include "tests/scenes/show.h"

namespace gonio::test {
namespace {

// What was made with less effort does not stay: a picture shown after an orbit is that of a renderer which knows no
// other.
TEST(Efforts, TheWholePictureComesBack) {
    Scene scene = scene_of(builtin("atrium"));
    scene.width_px = 322;  // not a multiple of the grid's four pixels
    scene.height_px = 182;
    Renderer fresh(context(), Renderer::DirectLight::rays), moved(context(), Renderer::DirectLight::rays);
    for (Renderer* renderer : {&fresh, &moved}) make_coarse(*renderer);
    show(fresh, scene);
    const std::vector<glm::vec3> whole = fresh.live_illuminance(scene, true);

    ASSERT_EQ(kQualityLevels[1].scale, 1.0);
    moved.set_quality_level(1);
    show(moved, scene);
    const std::vector<glm::vec3> less = moved.live_illuminance(scene, true);
    EXPECT_NE(less, whole) << "it is less";
    moved.set_quality_level(0);
    moved.begin_frame(scene, monotonic_ns());
    EXPECT_EQ(passes_run(moved.finish_frame(true)->report),
              (std::set<std::string>{"gbuffer", "gather-weights", "solve", "direct", "gather", "composite"}));
    EXPECT_EQ(moved.live_illuminance(scene, true), whole);
}

}  // namespace
}  // namespace gonio::test
