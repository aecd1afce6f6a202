// The sun in the live picture, captures and meters: E cos θ, the place of what a hole lets through, and every bounce
// against the reference.
#include <cmath>
#include <numbers>

#include "server/scene/scene.h"
#include "server/trace/reference.h"
#include "tests/gl/test_context.h"
#include "tests/scenes/show.h"

namespace gonio::test {
namespace {

Scene under_sun(std::vector<Piece> pieces, double lx, const glm::dvec3& aim) {
    Scene scene = scene_with(std::move(pieces), sun_profile(), {7, 8, 9}, orientation_aiming(aim));
    scene.lights[0].sun = true;
    scene.lights[0].multiplier = lx;
    return scene;
}

// A room of 4 × 3 × 4 m, its front open to the eye alone: a black wall stands far before it. In the ceiling is a slot
// of 1 × 2 m, at x from -1.5 to -0.5 and z from -1 to 1.
constexpr double kSlot[] = {-1.5, -0.5, -1.0, 1.0};
std::vector<Piece> room(float rho) {
    const glm::vec3 grey(rho);
    const auto roof = [](double x0, double x1, double z0, double z1) {
        return quad({x0, 3, z0}, {x1, 3, z0}, {x1, 3, z1}, {x0, 3, z1});
    };
    return {{quad({-2, 0, 2}, {2, 0, 2}, {2, 0, -2}, {-2, 0, -2}), grey},
            {quad({-2, 0, -2}, {2, 0, -2}, {2, 3, -2}, {-2, 3, -2}), grey},
            {quad({-2, 0, 2}, {-2, 0, -2}, {-2, 3, -2}, {-2, 3, 2}), grey},
            {quad({2, 0, -2}, {2, 0, 2}, {2, 3, 2}, {2, 3, -2}), grey},
            {quad({2, 0, 2}, {-2, 0, 2}, {-2, 3, 2}, {2, 3, 2}), grey},
            {roof(-2, kSlot[0], -2, 2), grey},
            {roof(kSlot[1], 2, -2, 2), grey},
            {roof(kSlot[0], kSlot[1], -2, kSlot[2]), grey},
            {roof(kSlot[0], kSlot[1], kSlot[3], 2), grey}};
}
const glm::dvec3 kAim(0.5, -1.5, 0.2);  // over the room's height it moves by (1, 0.4) m
Scene slotted(float rho) {
    Scene scene = under_sun(room(rho), 60000.0, kAim);
    scene.camera = {{0.0, 2.9, 0.001}, {0.0, 0.0, 0.0}, 1.2};
    scene.width_px = scene.height_px = 200;
    return scene;
}

TEST(Sun, LightsAnOpenPlaneInMeterAndPicture) {
    for (const double side : {0.05, 5.0, 2000.0}) {
        Renderer renderer(context(), direct_light());
        make_coarse(renderer);
        Scene scene =
            under_sun({{quad({-side, 0, side}, {side, 0, side}, {side, 0, -side}, {-side, 0, -side}), glm::vec3(0.5f)}},
                      90000.0, {1, -1, 0.5});
        scene.camera = {{0.0, side, 0.001 * side}, {0.0, 0.0, 0.0}, 0.8};
        scene.width_px = scene.height_px = 64;
        const double expected = 90000.0 / 1.5;
        EXPECT_NEAR(
            renderer.meter(scene, {0.3 * side, 0, 0}, {0, 1, 0}, Renderer::MeterQuality::interactive).direct_lx(),
            expected, 0.001 * expected)
            << side;
        show(renderer, scene);
        for (const glm::vec3& value : renderer.live_illuminance(scene, false))
            ASSERT_NEAR(static_cast<double>(value.g), expected, 0.003 * expected) << side;
        const auto picture = renderer.capture(scene, View::illuminance, 8, 8, true, 0);
        for (std::size_t i = 0; i < picture->values.size(); i += 4)
            ASSERT_NEAR(static_cast<double>(picture->values[i]), expected, 0.002 * expected) << side;
    }
}

// The slot's picture on the floor is as large as the slot, and moved by the aim.
TEST(Sun, ASlotIsSeenOnTheFloor) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    const Scene scene = slotted(0.5f);
    const int side = 300;
    const auto picture = renderer.capture(scene, View::illuminance, side, side, true, 0);
    const double cosine = -glm::normalize(kAim).y;
    const Eye eye = eye_of(scene.camera, side, side);
    double lit_m2 = 0.0, whole = 0.0;
    glm::dvec2 middle(0.0);
    for (int y = 0; y < side; ++y) {
        for (int x = 0; x < side; ++x) {
            const glm::dvec2 at((x + 0.5) / side * 2 - 1, 1 - (y + 0.5) / side * 2);
            const glm::dvec3 ray = ray_through(eye, at.x, at.y);
            const glm::dvec3 p = eye.position - ray * (eye.position.y / ray.y);
            const double lx = static_cast<double>(picture->values[static_cast<std::size_t>(y * side + x) * 4]);
            if (std::abs(p.x) > 1.95 || std::abs(p.z) > 1.95 || !(lx > 0.0)) continue;
            const double share = lx / (60000.0 * cosine);  // less than 1: of a pixel at the edge
            EXPECT_LT(share, 1.001);
            whole += share > 0.999;
            const double lit = share * std::pow(2 * 2.9 * std::tan(0.6) / side, 2.0);
            lit_m2 += lit;
            middle += lit * glm::dvec2(p.x, p.z);
        }
    }
    middle /= lit_m2;
    EXPECT_NEAR(lit_m2, 2.0, 0.01);
    EXPECT_GT(whole * std::pow(2 * 2.9 * std::tan(0.6) / side, 2.0), 1.9) << "all but edges have E cos";
    EXPECT_NEAR(middle.x, 0.5 * (kSlot[0] + kSlot[1]) + 1.0, 0.01);
    EXPECT_NEAR(middle.y, 0.4, 0.01);
    show(renderer, scene);
    double lit = 0.0, all = 0.0;
    for (const glm::vec3& value : renderer.live_illuminance(scene, false)) {
        lit += static_cast<double>(value.g) / (60000.0 * cosine);
        ++all;
    }
    EXPECT_NEAR(lit / all * std::pow(2 * 2.9 * std::tan(0.6), 2.0), 2.0, 0.04) << "live";
}

TEST(Sun, EveryBounceAgreesWithTheReference) {
    Renderer renderer(context(), direct_light());
    renderer.set_links(512);
    const Scene scene = slotted(0.6f);
    const trace::MeterPoint points[] = {{{1.5, 0, -1.5}, {0, 1, 0}}, {{-1.5, 0, 1.0}, {0, 1, 0}},
                                        {{0, 3, 1.5}, {0, -1, 0}},   {{-2, 1.5, 0}, {1, 0, 0}},
                                        {{2, 0.8, 0.5}, {-1, 0, 0}}, {{1.0, 2.0, -2}, {0, 0, 1}},
                                        {{-0.5, 0.7, 2}, {0, 0, -1}}};
    trace::Settings settings;
    settings.noise = 0.004;
    const auto truth = trace::measure(*trace::make_world(scene), points, settings);
    double squares = 0.0, bias = 0.0;
    for (std::size_t i = 0; i < std::size(points); ++i) {
        const double expected = glm::dot(truth[i].indirect_lx, glm::dvec3(0.2126, 0.7152, 0.0722));
        const double found =
            renderer.meter(scene, points[i].position, points[i].normal, Renderer::MeterQuality::interactive)
                .indirect_lx();
        const double off = found / expected - 1.0;
        EXPECT_NEAR(off, 0.0, 0.06) << i << ": " << found << " lx, " << expected;
        squares += off * off, bias += off;
    }
    EXPECT_LT(std::sqrt(squares / std::size(points)), 0.03);
    EXPECT_NEAR(bias / std::size(points), 0.0, 0.02);
    // The picture has what the meter has.
    Scene wide = scene;
    show(renderer, wide);
    const auto live = renderer.live_illuminance(wide, true);
    const auto captured = renderer.capture(wide, View::illuminance, 200, 200, true)->values;
    const auto direct = renderer.capture(wide, View::illuminance, 200, 200, true, 0)->values;
    double a = 0.0, b = 0.0;
    for (std::size_t i = 0; i < live.size(); ++i) {
        a += static_cast<double>(live[i].g);
        b += static_cast<double>(captured[4 * i] - direct[4 * i]);
    }
    EXPECT_NEAR(a, b, 0.03 * b);
}

}  // namespace
}  // namespace gonio::test
