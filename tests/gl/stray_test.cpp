// Stray pixels: those that lie outside of what the path tracer's picture has around them, as at contacts and edges
// that take the light of a wrong surface.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <vector>

#include "server/scene/scene.h"
#include "shaders/lib/as_cpp.h"
#include "tests/gl/flip.h"
#include "tests/gl/test_context.h"
#include "tests/scenes/show.h"

namespace gonio::test {
namespace {

constexpr int kStraySide = 160;
constexpr std::uint32_t kSamples = 192;

// What a display shows, luma from 0 to 255, rows from the top.
using Luma = std::vector<float>;
float luma_of(const glm::vec3& srgb) {
    return 255.0f * glsl::luminance(srgb);
}

Luma traced(const Scene& scene) {
    trace::Settings settings;
    settings.noise = 0.0;
    settings.max_passes = kSamples;
    trace::Picture picture(trace::make_world(scene),
                           {scene.camera, kStraySide, kStraySide, trace::Quantity::radiance, true}, settings);
    while (!picture.refine(10.0).complete) {
    }
    const std::vector<float> values = picture.values();
    Luma luma;
    for (std::size_t i = 0; i < values.size(); i += 4) {
        glm::vec3 shown(glsl::background_shade());
        if (values[i + 3] > 0.0f) {
            const glm::vec3 surfaces = glm::vec3(values[i], values[i + 1], values[i + 2]) / values[i + 3];
            const glm::vec3 display = glsl::expose(surfaces, static_cast<float>(scene.exposure_ev100));
            shown = glm::mix(shown, glsl::encode_display(display, 0, 0), values[i + 3]);
        }
        luma.push_back(luma_of(shown));
    }
    return luma;
}

// Result: how many pixels lie outside of the range of the 3 × 3 pixels around them by more than so many codes.
int stray_pixels(const Luma& shown, const Luma& truth, float codes) {
    int stray = 0;
    for (int y = 1; y + 1 < kStraySide; ++y) {
        for (int x = 1; x + 1 < kStraySide; ++x) {
            float least = 255.0f, greatest = 0.0f;
            for (int k = 0; k < 9; ++k) {
                const float there = truth[static_cast<std::size_t>((y + k / 3 - 1) * kStraySide + x + k % 3 - 1)];
                least = std::min(least, there), greatest = std::max(greatest, there);
            }
            const float here = shown[static_cast<std::size_t>(y * kStraySide + x)];
            stray += here < least - codes || here > greatest + codes ? 1 : 0;
        }
    }
    return stray;
}

struct StrayCase {
    const char* scene;
    double most;  // share of all pixels; flutes and folds finer than a pixel have the indirect light of its centre
};
class Stray : public testing::TestWithParam<StrayCase> {};
INSTANTIATE_TEST_SUITE_P(Cornell, Stray, testing::Values(StrayCase{"cornell", 0.0002}));
INSTANTIATE_TEST_SUITE_P(Atrium, Stray, testing::Values(StrayCase{"atrium", 0.002}));

TEST_P(Stray, NoPixelsInStillsAndAtRest) {
    Scene scene = scene_of(builtin(GetParam().scene));
    scene.width_px = scene.height_px = kStraySide;
    const Luma truth = traced(scene);
    for (const auto direct : {Renderer::DirectLight::rays, Renderer::DirectLight::gl}) {
        Renderer renderer(context(), direct);
        renderer.set_refinement(true);
        const auto still = renderer.capture(scene, View::beauty, kStraySide, kStraySide, false);
        Luma in_still, at_rest;
        for (std::size_t i = 0; i < still->rgba8.size(); i += 4)
            in_still.push_back(luma_of(glm::vec3(still->rgba8[i], still->rgba8[i + 1], still->rgba8[i + 2]) / 255.0f));
        std::shared_ptr<const std::vector<std::uint8_t>> nv12;
        const auto show_all = [&] {
            do {
                renderer.begin_frame(scene, monotonic_ns());
                if (const auto frame = renderer.finish_frame(true); frame->nv12) nv12 = frame->nv12;
            } while (!renderer.settled());
        };
        show_all();
        while (!renderer.refined(scene))
            if (renderer.refine(scene, [] { return false; })) show_all();
        for (const glm::vec3& srgb : picture_of_nv12(*nv12, kStraySide, kStraySide).srgb)
            at_rest.push_back(luma_of(srgb));
        for (const auto& [what, shown] : {std::pair("still", &in_still), {"at rest", &at_rest}}) {
            const int stray = stray_pixels(*shown, truth, 16.0f);
            std::printf("%s, %s, %s: %d of %d pixels\n", GetParam().scene,
                        direct == Renderer::DirectLight::gl ? "gl" : "rays", what, stray, kStraySide * kStraySide);
            EXPECT_LE(stray, GetParam().most * kStraySide * kStraySide) << what;
        }
    }
}

}  // namespace
}  // namespace gonio::test
