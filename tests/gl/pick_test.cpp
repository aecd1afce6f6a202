// What a place in the picture is: against the geometry that is known, the meter, and the picture's own values.
#include "server/session/pick.h"

#include <cmath>
#include <numbers>

#include "protocol/schema/measure.pb.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "tests/gl/test_context.h"

namespace gonio::test {
namespace {

v1::PickQuery at(double x, double y) {
    v1::PickQuery query;
    query.set_x(x), query.set_y(y);
    return query;
}

// A floor that the camera looks down to, under one luminaire of 100 cd.
TEST(Pick, IsThePointUnderThePointer) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    Scene scene = floor_scene(20.0, 0.5f, isotropic(100.0), {0.3, 2.0, -0.2});
    scene.camera = {{0.0, 4.0, 0.0001}, {0.0, 0.0, 0.0}, 2.0 * std::atan(0.5)};  // 4 m of the floor are as high as it
    scene.width_px = 200, scene.height_px = 100;
    for (const glm::dvec2& place : {glm::dvec2(0.5, 0.5), glm::dvec2(0.75, 0.25), glm::dvec2(0.0, 1.0)}) {
        const auto picked = pick_at(scene, at(place.x, place.y));
        ASSERT_TRUE(picked && picked->pick.hit());
        const glm::dvec3 expected((2.0 * place.x - 1.0) * 4.0, 0.0, (2.0 * place.y - 1.0) * 2.0);
        EXPECT_LT(glm::distance(picked->point.position, expected), 0.001) << place.x << " " << place.y;
        EXPECT_LT(glm::distance(picked->point.normal, glm::dvec3(0, 1, 0)), 1e-6);
        EXPECT_NEAR(picked->pick.distance_m(), glm::distance(scene.camera.eye, expected), 0.001);
        const auto reading =
            renderer.meter(scene, picked->point.position, picked->point.normal, Renderer::MeterQuality::interactive);
        const glm::dvec3 d = scene.lights[0].position - expected;
        const double lx = 100.0 * d.y / std::pow(glm::dot(d, d), 1.5);
        const v1::Pick answer = with_reading(*picked, reading);
        EXPECT_NEAR(answer.reading().total_lx(), lx, 0.005 * lx);
        EXPECT_NEAR(answer.luminance_nit(), 0.5 * lx / std::numbers::pi, 0.005 * lx);
    }
    scene.camera.target = {0.0, 8.0, 0.0};
    EXPECT_FALSE(pick_at(scene, at(0.5, 0.5))->pick.hit()) << "the sky";
}

// The picture of lux and that of luminance have the same values there.
TEST(Pick, AgreesWithThePicture) {
    Renderer renderer(context(), direct_light());
    renderer.set_links(512);
    Scene scene = scene_of(builtin("cornell"));
    constexpr int kSide = 64;
    scene.width_px = scene.height_px = kSide;
    const auto lux = renderer.capture(scene, View::illuminance, kSide, kSide, true, trace::kAllBounces, 1)->values,
               nit = renderer.capture(scene, View::luminance, kSide, kSide, true, trace::kAllBounces, 1)->values;
    double off_lx = 0.0, off_nit = 0.0, mean_lx = 0.0, mean_nit = 0.0;
    int count = 0;
    for (int y = 3; y < kSide; y += 11) {
        for (int x = 2; x < kSide; x += 9) {
            const auto picked = pick_at(scene, at((x + 0.5) / kSide, (y + 0.5) / kSide));
            ASSERT_TRUE(picked);
            if (!picked->pick.hit()) continue;
            const v1::Pick pick =
                with_reading(*picked, renderer.meter(scene, picked->point.position, picked->point.normal,
                                                     Renderer::MeterQuality::interactive));
            const auto i = static_cast<std::size_t>(y * kSide + x) * 4;
            off_lx += std::abs(pick.reading().total_lx() - static_cast<double>(lux[i]));
            off_nit += std::abs(pick.luminance_nit() - static_cast<double>(nit[i]));
            mean_lx += pick.reading().total_lx(), mean_nit += pick.luminance_nit();
            EXPECT_FALSE(pick.node().empty());
            ++count;
        }
    }
    EXPECT_GT(count, 30);
    std::printf("mean difference: %.4f of lux, %.4f of cd/m²\n", off_lx / mean_lx, off_nit / mean_nit);
    EXPECT_LT(off_lx, 0.03 * mean_lx);
    EXPECT_LT(off_nit, 0.03 * mean_nit);
}

TEST(Pick, PlacesOutsideAreRefused) {
    const Scene scene = scene_of(builtin("cornell"));
    for (const double wrong : {-0.01, 1.01, std::nan("")}) {
        const auto x = pick_at(scene, at(wrong, 0.5)), y = pick_at(scene, at(0.5, wrong));
        ASSERT_FALSE(x);
        EXPECT_EQ(x.error().where, "pick.x");
        ASSERT_FALSE(y);
        EXPECT_EQ(y.error().code, "invalid_argument");
        EXPECT_EQ(y.error().where, "pick.y");
        EXPECT_EQ(y.error().value, print_number(wrong));
    }
}

}  // namespace
}  // namespace gonio::test
