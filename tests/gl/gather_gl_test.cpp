// Where shaders gather: the same light as on the CPU, and no frame reads anything back.
#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "tests/gl/test_context.h"
#include "tests/scenes/bench_scenes.h"

namespace gonio::test {
namespace {

class GatherGl : public testing::TestWithParam<const char*> {
protected:
    Scene scene_of_size(int side_px) const {
        Scene scene = scene_of(builtin(GetParam()));
        scene.width_px = scene.height_px = side_px;
        return scene;
    }
    // Result: indirect light at the pixels of the live picture, settled or at rest.
    static std::vector<glm::vec3> shown(Renderer::DirectLight shading, const Scene& scene, bool at_rest) {
        Renderer renderer(context(), shading);
        if (at_rest) renderer.set_links(128);  // each pixel has links of its own then
        renderer.set_refinement(at_rest);
        const auto frame = [&] {
            renderer.begin_frame(scene, 0);
            const v1::FrameReport report = renderer.finish_frame(true)->report;
            for (const v1::PassReport& row : report.passes()) {
                const bool reads_back = row.name() == "gbuffer-readback" || row.name() == "gbuffer-cpu";
                EXPECT_FALSE(reads_back && row.state() == "ran") << row.name();
            }
            return report.settled();
        };
        while (!frame()) {
        }
        while (at_rest && !renderer.refined(scene)) renderer.refine(scene, [] { return false; });
        return renderer.live_illuminance(scene, true);
    }
    // Result: the share of pixels whose light is within 1 %, of those with any. every: of so many pixels along each
    // side one.
    static double alike(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b, int side_px, int every) {
        std::size_t lit = 0, like = 0;
        for (int y = every / 2; y < side_px; y += every) {
            for (int x = every / 2; x < side_px; x += every) {
                const auto p = static_cast<std::size_t>(y * side_px + x);
                if (a[p] == glm::vec3(0.0f) && b[p] == glm::vec3(0.0f)) continue;
                const glm::vec3 off = glm::abs(a[p] - b[p]);
                ++lit;
                like += glm::all(glm::lessThanEqual(off, 0.01f * b[p])) ? 1u : 0u;
            }
        }
        EXPECT_GT(lit, static_cast<std::size_t>(side_px * side_px / every / every) / 2);
        return static_cast<double>(like) / static_cast<double>(lit);
    }
};
struct GatherGlAtRest : GatherGl {};
// A suite for each scene: a renderer keeps the links of the scene before alone.
INSTANTIATE_TEST_SUITE_P(Cornell, GatherGl, testing::Values("cornell"));
INSTANTIATE_TEST_SUITE_P(Atrium, GatherGl, testing::Values("atrium"));
INSTANTIATE_TEST_SUITE_P(Cornell, GatherGlAtRest, testing::Values("cornell"));
INSTANTIATE_TEST_SUITE_P(Atrium, GatherGlAtRest, testing::Values("atrium"));

// Both blend the same surfels: shaders at every pixel, the CPU at one of sixteen, from which it is brought to the
// others.
TEST_P(GatherGl, BlendsAsTheCpuDoes) {
    const Scene scene = scene_of_size(800);
    const auto gl = shown(Renderer::DirectLight::gl, scene, false),
               cpu = shown(Renderer::DirectLight::rays, scene, false);
    const double share = alike(gl, cpu, scene.width_px, 4);
    std::printf("%s: %.2f %% of the points within 1 %%\n", GetParam(), 100.0 * share);
    EXPECT_GT(share, 0.99);
}

// At rest every pixel has links of its own.
TEST_P(GatherGlAtRest, EveryPixelIsTheCpus) {
    const Scene scene = scene_of_size(160);
    const auto gl = shown(Renderer::DirectLight::gl, scene, true),
               cpu = shown(Renderer::DirectLight::rays, scene, true);
    const double share = alike(gl, cpu, scene.width_px, 1);
    std::printf("%s: %.2f %% of the pixels within 1 %%\n", GetParam(), 100.0 * share);
    EXPECT_GT(share, 0.99);
}

// A console moves many heads at once: one solve, and one gather of all of them.
TEST(GatherGlMany, ThatMoveAreSolvedAsOne) {
    Renderer renderer(context(), Renderer::DirectLight::gl);
    make_coarse(renderer);
    Scene scene = scene_of(make_stage(4));
    scene.width_px = scene.height_px = 200;
    std::map<std::string, int> ran;
    const auto frame = [&] {
        renderer.begin_frame(scene, 0);
        const v1::FrameReport report = renderer.finish_frame(true)->report;
        ran.clear();
        for (const v1::PassReport& row : report.passes()) ran[row.name()] += row.state() == "ran" ? 1 : 0;
        return report.settled();
    };
    const auto settle = [&] {
        for (int frames = 0; !frame(); ++frames) ASSERT_LT(frames, 40);
    };
    settle();
    ++scene.scene_rev;
    for (Light& light : scene.lights) {
        light.position.x += 0.4;
        light.position_rev = scene.scene_rev;
    }
    EXPECT_FALSE(frame());
    EXPECT_EQ(ran["merge"], 1);
    EXPECT_EQ(ran["solve"], 1);
    EXPECT_EQ(ran["surfels"], 16);
    EXPECT_EQ(ran["direct"], 16);
    EXPECT_EQ(ran["gather"], 0);
    EXPECT_EQ(ran["gbuffer"] + ran["gather-weights"], 0);
    const std::vector<glm::vec3> at_once = renderer.live_illuminance(scene, true);
    settle();
    const std::vector<glm::vec3> own = renderer.live_illuminance(scene, true);
    double off = 0.0, sum = 0.0;
    for (std::size_t p = 0; p < own.size(); ++p) {
        off += static_cast<double>(std::abs(at_once[p].g - own[p].g));
        sum += static_cast<double>(own[p].g);
    }
    std::printf("one frame behind: %.4f\n", off / sum);
    EXPECT_LT(off / sum, 0.05) << "a solve while it moves ends at 2 %";
}

}  // namespace
}  // namespace gonio::test
