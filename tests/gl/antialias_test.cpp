// Edges of surfaces and of shadows against the path tracer's, whose every sample is a ray of its own; what they cost.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <tuple>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/report.pb.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "server/trace/sources.h"
#include "tests/gl/test_context.h"
#include "tests/scenes/scenes.h"
#include "tests/scenes/show.h"

namespace gonio::test {
namespace {

constexpr int kEdgeSide = 200;

// Luminance of direct light, cd/m², rows from the top: 4 floats a pixel.
const std::vector<float>& traced_direct(const Scene& scene) {
    static const std::vector<float> values = [&] {
        trace::Settings settings;
        settings.noise = 0.01;
        settings.max_passes = 256;
        trace::Picture picture(trace::make_world(scene),
                               {scene.camera, kEdgeSide, kEdgeSide, trace::Quantity::radiance_direct, true}, settings);
        while (!picture.refine(1.0).complete) {
        }
        return picture.values();
    }();
    return values;
}

Scene cornell() {
    Scene scene = scene_of(builtin("cornell"));
    scene.width_px = scene.height_px = kEdgeSide;
    return scene;
}

// Result: rms of the difference over the mean, of the pixels that `counts`.
template <typename Counts>
double rms(const std::vector<float>& shown, const std::vector<float>& truth, const Counts& counts) {
    double squares = 0.0, sum = 0.0;
    int n = 0;
    for (std::size_t i = 0; i < truth.size(); i += 4) {
        if (!counts(i)) continue;
        const double off = static_cast<double>(shown[i + 1] - truth[i + 1]);
        squares += off * off, sum += static_cast<double>(truth[i + 1]), ++n;
    }
    return std::sqrt(squares / n) / (sum / n);
}

TEST(Antialias, StillsHaveTheEdgesOfTheReference) {
    const Scene scene = cornell();
    Renderer renderer(context(), Renderer::DirectLight::rays);
    const auto still = [&](unsigned samples) {
        return renderer.capture(scene, View::direct, kEdgeSide, kEdgeSide, true, trace::kAllBounces, samples)->values;
    };
    const std::vector<float> jagged = still(1), smooth = still(16), &truth = traced_direct(scene);
    // Edges: where the centres alone are off by a tenth.
    const auto edge = [&](std::size_t i) {
        return std::abs(jagged[i + 1] - truth[i + 1]) > 0.1f * std::max(truth[i + 1], 0.1f);
    };
    const double before = rms(jagged, truth, edge), after = rms(smooth, truth, edge),
                 elsewhere = rms(smooth, truth, [&](std::size_t i) { return !edge(i); });
    std::printf("rms at edges: one sample %.3f, sixteen %.3f; elsewhere %.4f\n", before, after, elsewhere);
    EXPECT_LT(after, 0.3 * before);
    EXPECT_LT(elsewhere, 0.02) << "what curves within a pixel has the cosine of its centre";
}

// A floor below a board whose edge is slanted. The shadow's edge on the floor is x = slope z + 1; a pixel is 3 mm wide,
// and so is a texel of a shadow cube.
constexpr double kSlope = 0.3;
Scene below_a_board() {
    const double far = 5.0;
    const auto edge = [&](double z) { return glm::dvec3(0.5 * (kSlope * z + 1.0), 1.0, 0.5 * z); };
    Scene scene = scene_with({{quad({-far, 0, far}, {far, 0, far}, {far, 0, -far}, {-far, 0, -far}), glm::vec3(0.5f)},
                              {quad(edge(far), edge(-far), {-far, 1, -far}, {-far, 1, far}), glm::vec3(0.0f)}},
                             isotropic(1000.0), {0, 2, 0});
    scene.camera = {{1.0, 6.0, 0.0001}, {1.0, 0.0, 0.0}, 0.03};
    scene.width_px = scene.height_px = 60;
    return scene;
}

// Rms over the pixels that the edge crosses: direct light, lux, rows from the bottom, over what there is without the
// board, less the pixel's share beyond the edge.
double off_coverage(const Scene& scene, const std::function<double(int x, int y)>& lux) {
    const int side = scene.width_px;
    const Eye eye = eye_of(scene.camera, side, side);
    const auto floor_at = [&](double x, double y) {
        const glm::dvec3 ray = ray_through(eye, x / side * 2 - 1, y / side * 2 - 1);
        return eye.position - ray * (eye.position.y / ray.y);
    };
    double squares = 0.0;
    int crossed = 0;
    for (int y = 0; y < side; ++y) {
        for (int x = 0; x < side; ++x) {
            constexpr int kFine = 32;
            int beyond = 0;
            for (int i = 0; i < kFine * kFine; ++i) {
                const glm::dvec3 p = floor_at(x + (i % kFine + 0.5) / kFine, y + (i / kFine + 0.5) / kFine);
                beyond += p.x > kSlope * p.z + 1.0 ? 1 : 0;
            }
            if (beyond == 0 || beyond == kFine * kFine) continue;
            const glm::dvec3 p = floor_at(x + 0.5, y + 0.5);
            const double open_lx = 2000.0 / std::pow(glm::dot(p, p) + 4.0 - p.y * p.y, 1.5);
            squares += std::pow(lux(x, y) / open_lx - static_cast<double>(beyond) / (kFine * kFine), 2.0);
            ++crossed;
        }
    }
    EXPECT_GT(crossed, side / 2);
    return std::sqrt(squares / crossed);
}

// In stills and at rest the share of a pixel that a shadow leaves is that of its samples, also where a shadow cube
// lights what moves.
TEST(Antialias, AShadowLeavesThePixelsShare) {
    for (const auto direct : {Renderer::DirectLight::rays, Renderer::DirectLight::gl}) {
        const Scene scene = below_a_board();
        const int side = scene.width_px;
        Renderer renderer(context(), direct);
        make_coarse(renderer);
        const auto still = renderer.capture(scene, View::illuminance, side, side, true, 0)->values;
        const double in_still = off_coverage(scene, [&](int x, int y) {
            return static_cast<double>(still[4 * static_cast<std::size_t>((side - 1 - y) * side + x)]);
        });
        const auto live = [&] {
            const auto light = renderer.live_illuminance(scene, false);
            return off_coverage(scene, [&](int x, int y) {
                return static_cast<double>(light[static_cast<std::size_t>(y * side + x)].g);
            });
        };
        renderer.set_refinement(true);
        show(renderer, scene);
        const double moving = live();
        while (!renderer.refined(scene))
            if (renderer.refine(scene, [] { return false; })) show(renderer, scene);
        const double at_rest = live();
        std::printf("%s: off by %.3f while it moves, %.3f at rest, %.3f in a still\n",
                    direct == Renderer::DirectLight::gl ? "gl" : "rays", moving, at_rest, in_still);
        EXPECT_GT(moving, 0.15);
        EXPECT_LT(at_rest, 0.06);
        EXPECT_LT(in_still, 0.06);
    }
}

// A pixel is stray where it lies outside of what the reference has around it, by more than its dither and noise.
TEST(Antialias, NoStrayPixelsAtContacts) {
    const Scene scene = cornell();
    Renderer renderer(context(), Renderer::DirectLight::rays);
    const std::vector<float> shown = renderer.capture(scene, View::direct, kEdgeSide, kEdgeSide, true)->values,
                             &truth = traced_direct(scene);
    int stray = 0;
    for (int y = 1; y + 1 < kEdgeSide; ++y) {
        for (int x = 1; x + 1 < kEdgeSide; ++x) {
            float least = 1e30f, greatest = 0.0f;
            for (int k = 0; k < 9; ++k) {
                const float there =
                    truth[4 * static_cast<std::size_t>((y + k / 3 - 1) * kEdgeSide + x + k % 3 - 1) + 1];
                least = std::min(least, there), greatest = std::max(greatest, there);
            }
            const float here = shown[4 * static_cast<std::size_t>(y * kEdgeSide + x) + 1],
                        room = 0.1f * greatest + 0.05f;
            const bool odd = here < least - room || here > greatest + room;
            stray += odd ? 1 : 0;
        }
    }
    std::printf("stray pixels: %d of %d\n", stray, kEdgeSide * kEdgeSide);
    EXPECT_LE(stray, kEdgeSide * kEdgeSide / 20000);
}

// Edges are found while nothing moves. They stay where light moves, and cost no pass of their own.
TEST(Antialias, LightThatMovesStaysAntialiased) {
    Scene scene = cornell();
    Renderer renderer(context(), Renderer::DirectLight::rays);
    make_coarse(renderer);
    renderer.set_refinement(true);
    const auto frame = [&] {
        renderer.begin_frame(scene, monotonic_ns());
        return renderer.finish_frame(true)->report;
    };
    const auto change = [&](const v1::Command& command) {
        Loaded loaded;
        const auto result = apply(scene, command, loaded);
        ASSERT_TRUE(result) << result.error().text();
    };
    show(renderer, scene);
    EXPECT_EQ(frame().samples_per_pixel(), 1u);
    ASSERT_TRUE(renderer.refine(scene, [] { return false; })) << "before anything else";
    const v1::FrameReport smooth = frame();
    EXPECT_EQ(smooth.samples_per_pixel(), 16u);
    EXPECT_EQ(passes_run(smooth), std::set<std::string>{"composite"});

    v1::Command level;
    level.mutable_set_light()->set_name(scene.lights[0].name);
    level.mutable_set_light()->set_level_ratio(0.5);
    change(level);
    const v1::FrameReport dimmed = frame();
    EXPECT_EQ(dimmed.samples_per_pixel(), 16u);
    EXPECT_EQ(passes_run(dimmed), std::set<std::string>{"composite"});

    v1::Command position;
    position.mutable_set_light()->set_name(scene.lights[0].name);
    for (const double x : {0.3, 3.0, 0.2}) position.mutable_set_light()->add_position_m(x);
    change(position);
    const v1::FrameReport moved = frame();
    EXPECT_EQ(moved.samples_per_pixel(), 16u);
    EXPECT_FALSE(passes_run(moved).contains("gbuffer"));

    v1::Command camera;
    for (const double x : {0.1, 2.0, 6.5}) camera.mutable_set_camera()->add_eye_m(x);
    change(camera);
    EXPECT_EQ(frame().samples_per_pixel(), 1u);
    show(renderer, scene);
    ASSERT_TRUE(renderer.refine(scene, [] { return false; }));
    EXPECT_EQ(frame().samples_per_pixel(), 16u);
}

// While nothing has been found yet edges are filtered, which makes no pass of its own.
TEST(Antialias, EdgesAreFilteredUntilTheyAreFound) {
    for (const auto direct : {Renderer::DirectLight::rays, Renderer::DirectLight::gl}) {
        Scene scene = cornell();
        scene.width_px = scene.height_px = 2 * kEdgeSide;
        const auto newest = [&](Renderer& renderer) {
            FinishedFrame frame;
            do {
                renderer.begin_frame(scene, monotonic_ns());
                FinishedFrame done = *renderer.finish_frame(true);
                if (done.nv12) frame = std::move(done);
            } while (!renderer.settled());
            return frame;
        };
        Renderer plain(context(), direct), renderer(context(), direct);
        make_coarse(plain);
        make_coarse(renderer);
        renderer.set_refinement(true);
        const auto jagged = newest(plain).nv12;
        const FinishedFrame moving = newest(renderer);
        ASSERT_TRUE(renderer.refine(scene, [] { return false; }));
        const FinishedFrame rests = newest(renderer);
        ASSERT_EQ(moving.report.samples_per_pixel(), 1u);
        ASSERT_EQ(rests.report.samples_per_pixel(), 16u);
        const auto off = [&](const std::vector<std::uint8_t>& nv12) {
            double squares = 0.0;
            for (std::size_t i = 0; i < std::size_t{4} * kEdgeSide * kEdgeSide; ++i)
                squares += std::pow(static_cast<double>((*rests.nv12)[i]) - static_cast<double>(nv12[i]), 2.0);
            return std::sqrt(squares);
        };
        const auto composite_ms = [](const FinishedFrame& frame) {
            double ms = 0.0;
            for (const v1::PassReport& row : frame.report.passes())
                if (row.name() == "composite" || row.name() == "nv12") ms += row.cpu_ms();
            return ms;
        };
        std::printf("of what edges lack %.2f is left; composite %.2f ms\n", off(*moving.nv12) / off(*jagged),
                    composite_ms(moving));
        EXPECT_LT(off(*moving.nv12), 0.9 * off(*jagged));
    }
}

// Rms and mean of a capture's direct light over what is expected in the middle third of its width.
struct OverExpected {
    double mean = 0.0, rms = 0.0;
};
OverExpected direct_over(const Scene& scene, double expected_nit, int side, unsigned samples) {
    Renderer renderer(context(), Renderer::DirectLight::rays);
    const auto still = renderer.capture(scene, View::direct, side, side, true, trace::kAllBounces, samples);
    OverExpected found;
    int n = 0;
    for (int y = 1; y < side - 1; ++y) {
        for (int x = side / 3; x < side - side / 3; ++x, ++n) {
            const double over =
                static_cast<double>(still->values[4 * static_cast<std::size_t>(y * side + x) + 1]) / expected_nit;
            found.mean += over;
            found.rms += (over - 1.0) * (over - 1.0);
        }
    }
    return {found.mean / n, std::sqrt(found.rms / n)};
}

void append(Mesh& mesh, const Mesh& part) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), part.vertices.begin(), part.vertices.end());
    for (const std::uint32_t index : part.indices) mesh.indices.push_back(first + index);
}

// A wall of folds finer than a pixel, both sides at 45°, lit from 30° aside. Neither side shadows the other. Both cover
// half of each pixel, with cosines of 15° and 75°: their mean is cos 30° cos 45°.
TEST(Antialias, FoldsFinerThanAPixelHaveTheMeanOfTheirLight) {
    constexpr int kPixels = 48;
    constexpr double kFold = 0.61 / kPixels, kHeight = 0.5 * kFold, kFar = 1000.0;  // the picture is 1 m wide
    Mesh folds;
    for (double x = -0.2; x < 0.2; x += kFold) {
        for (const auto& [low, high, z0, z1] :
             {std::tuple(x, x + kHeight, 0.0, kHeight), std::tuple(x + kHeight, x + kFold, kHeight, 0.0)}) {
            append(folds, quad({low, -1, z0}, {high, -1, z1}, {high, 1, z1}, {low, 1, z0}));
        }
    }
    const double aside = std::numbers::pi / 6.0;
    Scene scene =
        scene_with({{folds, glm::vec3(0.5f)}}, isotropic(1e7), {kFar * std::sin(aside), 0.0, kFar * std::cos(aside)});
    scene.camera = {{0, 0, 50}, {0, 0, 0}, 2.0 * std::atan(0.5 / 50)};
    const double lux = 1e7 / (kFar * kFar) * std::cos(aside) * std::numbers::sqrt2 / 2.0,
                 nit = 0.5 * lux / std::numbers::pi;
    const OverExpected one = direct_over(scene, nit, kPixels, 1), sixteen = direct_over(scene, nit, kPixels, 16);
    std::printf("folds: mean %.3f, rms %.3f; one sample %.3f\n", sixteen.mean, sixteen.rms, one.rms);
    EXPECT_NEAR(sixteen.mean, 1.0, 0.01);
    EXPECT_LT(sixteen.rms, 0.12) << "sixteen strata of each pixel";
    EXPECT_GT(one.rms, 0.5);
}

// A wall 2 m before the camera and a pane at 1.5 m, lit by 100 cd from 4 m.
struct Pane {
    Scene scene;
    static Mesh plate(double left, double right, double z) {
        return quad({left, -1, z}, {right, -1, z}, {right, 1, z}, {left, 1, z});
    }
    explicit Pane(const Mesh& pane)
        : scene(scene_with({{plate(-1.0, 1.0, 0.0), glm::vec3(0.4f)}, {pane, glm::vec3(0.8f)}}, isotropic(100.0),
                           {0, 0, 4})) {
        scene.camera = {{0, 0, 2}, {0, 0, 0}, 0.05};
    }
    template <typename Change>
    void paint(const Change& change) {
        auto asset = std::make_shared<SceneAsset>(*scene.asset);
        change(asset->materials[1]);
        scene.asset = asset;
    }
    // Result: the luminance of both where the pane covers so much.
    double blend(double covers) {
        paint([&](Material& material) {
            material.alpha_blend = true;
            material.base_color.a = static_cast<float>(covers);
        });
        const double on_pane = 100.0 / (3.5 * 3.5), on_wall = (1.0 - covers) * 100.0 / 16.0;
        return (covers * 0.8 * on_pane + (1.0 - covers) * 0.4 * on_wall) / std::numbers::pi;
    }
};

// A pane as wide as the picture, and one of many triangles: the mean is that of the light, pixel by pixel.
TEST(Antialias, APaneMayFillThePicture) {
    Mesh strips;
    for (int i = 0; i < 40; ++i) append(strips, Pane::plate(-0.06 + 0.003 * i, -0.06 + 0.003 * (i + 1), 0.5));
    for (const Mesh& mesh : {Pane::plate(-1.0, 1.0, 0.5), strips}) {
        for (const double covers : {0.25, 0.45, 0.7}) {
            Pane pane(mesh);
            const double nit = pane.blend(covers);
            for (const unsigned samples : {16u, 64u}) {
                const OverExpected over = direct_over(pane.scene, nit, 32, samples);
                std::printf("pane of %zu triangles, %.2f, %u samples: mean %.4f, rms %.4f\n", mesh.indices.size() / 3,
                            covers, samples, over.mean, over.rms);
                EXPECT_NEAR(over.mean, 1.0, 0.005) << covers;
                EXPECT_LT(over.rms, 0.06) << covers << ": one of sixteen samples more or less";
            }
        }
    }
}

TEST(Antialias, ColouredGlassThatIsSeenHasItsColourOnce) {
    Pane pane(Pane::plate(-1.0, 1.0, 0.5));
    pane.paint([](Material& material) {
        material.transmission = 0.8f;
        material.base_color = {1.0f, 0.25f, 1.0f, 1.0f};
    });
    pane.scene.camera = {{0.1, 0.2, 2}, {0.0, 0.05, 0}, 0.05};  // aslant: depths are rounded
    Renderer renderer(context(), Renderer::DirectLight::rays);
    const auto still = renderer.capture(pane.scene, View::direct, 64, 64, true, trace::kAllBounces, 16);
    const auto expected = [&](double c) {
        return 0.2 * c * 100.0 / (3.5 * 3.5) + 0.8 * c * 0.4 * 0.8 * c * 100.0 / 16.0;
    };
    float least = 1.0f;
    for (std::size_t i = 0; i < still->values.size(); i += 4)
        least = std::min(least, still->values[i + 1] / still->values[i]);
    EXPECT_GT(least, 0.94 * expected(0.25) / expected(1.0));
}

// Pixels' centres look through a pane that covers 5/16: its own light is found all the same.
TEST(Antialias, APaneHasItsOwnLight) {
    for (const std::size_t lights : {1u, 12u}) {  // the same from one, and from so many that they are lit as one
        Pane pane(Pane::plate(-0.016, 0.016, 0.5));
        const double nit = pane.blend(5.0 / 16.0);
        repeat_light(pane.scene, lights,
                     [lights](Light& light, std::size_t) { light.level_ratio = 1.0 / static_cast<double>(lights); });
        const OverExpected sixteen = direct_over(pane.scene, nit, 32, 16);
        std::printf("pane, %zu luminaires: mean %.4f, rms %.4f\n", lights, sixteen.mean, sixteen.rms);
        EXPECT_NEAR(sixteen.mean, 1.0, 0.005);
        EXPECT_LT(sixteen.rms, 0.04);
    }
}

}  // namespace
}  // namespace gonio::test
