// Better links come into a picture that nobody touches over some frames, not at once.
#include <cmath>
#include <cstdio>
#include <vector>

#include "server/assets/assets.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "tests/gl/test_context.h"
#include "tests/scenes/show.h"

namespace gonio::test {
namespace {

double rms(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b) {
    double squares = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double off = static_cast<double>(a[i].g) - static_cast<double>(b[i].g);
        squares += off * off;
    }
    return std::sqrt(squares / static_cast<double>(a.size()));
}

TEST(Generations, FadeIn) {
    constexpr std::size_t kFrames = 8;
    // Where shaders gather, the cells that rays have filled meanwhile come at once.
    Renderer renderer(context(), Renderer::DirectLight::rays);
    renderer.make_transport_beside();
    // Of no other test: its transport is made while this one looks.
    Scene scene = scene_of(std::make_shared<const SceneAsset>(*builtin("cornell")));
    scene.width_px = scene.height_px = 160;
    std::vector<std::vector<glm::vec3>> pictures;
    std::vector<unsigned> links;
    const auto frame = [&] {
        renderer.begin_frame(scene, monotonic_ns());
        links.push_back(renderer.finish_frame(true)->report.links());
        pictures.push_back(renderer.live_illuminance(scene, true));
        if (pictures.size() > 3 * kFrames) pictures.erase(pictures.begin());
    };
    while (renderer.ready(scene) != Readiness::all) frame();
    frame();
    while (!renderer.settled()) frame();
    // The last generation's frames, and the one before them.
    const std::size_t end = links.size(), shift = end - pictures.size();
    std::size_t better = end;
    while (better > shift && links[better - 1] == links.back()) --better;
    ASSERT_GT(better, shift) << "no frame before them is kept";
    const auto at = [&](std::size_t i) -> const std::vector<glm::vec3>& { return pictures[i - shift]; };
    EXPECT_EQ(end - better, kFrames);
    const double all = rms(at(better - 1), at(end - 1));
    std::printf("from %u links to %u: rms %.3f lx in all, %.3f in the first frame\n", links[better - 1], links[better],
                all, rms(at(better - 1), at(better)));
    EXPECT_GT(links[better - 1], 0u);
    EXPECT_GT(all, 0.0);
    for (std::size_t i = better; i < end; ++i) EXPECT_LT(rms(at(i - 1), at(i)), 1.2 * all / kFrames) << i - better;
    Renderer fresh(context(), Renderer::DirectLight::rays);
    show(fresh, scene);
    EXPECT_LT(rms(fresh.live_illuminance(scene, true), at(end - 1)), 0.01 * all) << "it is there in the end";
}

}  // namespace
}  // namespace gonio::test
