// Indirect light against closed forms: the integrating sphere, the empty plane, the sealed room.
#include <algorithm>

#include "server/assets/assets.h"
#include "server/scene/scene.h"
#include "server/trace/path.h"
#include "server/trace/reference.h"
#include "server/trace/sources.h"
#include "tests/gl/test_context.h"
#include "tests/scenes/placed.h"
#include "tests/shared_data.h"

namespace gonio::test {
namespace {

using Quality = Renderer::MeterQuality;

// Inside a diffuse sphere one bounce is uniform: rho · flux / (4 pi R²), wherever the luminaire stands.
TEST(Indirect, IntegratingSphere) {
    constexpr double radius = 2.0, rho = 0.5;
    struct Case {
        std::shared_ptr<const Profile> profile;
        glm::dvec3 light;
        PanTiltRoll turn;
    };
    const Case cases[] = {{isotropic(1000.0), {0, 0, 0}, {}},
                          {cosine_power(1000.0, 2.0), {0.5, 0.3, 0.4}, {0.3, 0.8, 0.0}},
                          {cosine_power(1000.0, 30.0), {-0.9, 0.6, 0.2}, {1.0, 2.0, 0.5}},
                          {as_point(*builtin_profile("wall_washer")), {0.2, -1.0, 0.7}, {-2.0, 1.2, 0.7}}};
    for (const Case& c : cases) {
        Renderer renderer(context(), direct_light());
        make_coarse(renderer);
        const Scene scene =
            scene_with({{inward_sphere(radius, 128), glm::vec3(rho)}}, c.profile, c.light, orientation_of(c.turn));
        const double expected = rho * c.profile->flux_lm / (4 * std::numbers::pi * radius * radius);
        for (const glm::dvec3& direction : {glm::dvec3{1, 0, 0},
                                            {0, -1, 0},
                                            {0, 1, 0},
                                            {-0.6, 0.0, 0.8},
                                            {0.577, -0.577, 0.577},
                                            {0.1, 0.2, -0.97}}) {
            const glm::dvec3 d = glm::normalize(direction);
            const auto reading = renderer.meter(scene, d * radius, -d, Quality::rsm);
            EXPECT_NEAR(reading.indirect_lx(), expected, 0.005 * expected)
                << c.profile->name << " at " << d.x << "," << d.y << "," << d.z;
        }
    }
}

// The same through links and surfels; and after every bounce: rho Phi / (4 pi R² (1 - rho)).
TEST(Indirect, IntegratingSphereInThePicture) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    const auto profile = cosine_power(1000.0, 2.0);
    Scene scene = scene_with({{inward_sphere(2.0, 128), glm::vec3(0.5f)}}, profile, {0.5, 0.3, 0.4},
                             orientation_of({0.3, 0.8, 0.0}));
    const double expected = 0.5 * profile->flux_lm / (16 * std::numbers::pi);
    // A millimetre inside the sphere: its facets lie up to 0.15 mm inside the radius.
    for (const glm::dvec3& d : {glm::dvec3{1, 0, 0}, {0, 1, 0}, {-0.6, 0.0, 0.8}}) {
        const auto reading = [&](int bounces) {
            return renderer.meter(scene, d * 1.999, -d, Quality::interactive, bounces);
        };
        EXPECT_NEAR(reading(1).indirect_lx(), expected, 0.01 * expected);
        EXPECT_EQ(reading(1).bounces(), "1");
        EXPECT_NEAR(reading(trace::kAllBounces).indirect_lx(), 2.0 * expected, 0.02 * expected);
        EXPECT_EQ(reading(trace::kAllBounces).bounces(), "all");
        EXPECT_EQ(reading(0).indirect_lx(), 0.0);
    }
}

// Light that falls on a few surfels alone: a beam, and a bulb 4 cm from a wall. However small the spot, in the end all
// flux is absorbed: the mean of E over the walls of a closed room is rho Phi / (A (1 - rho)).
TEST(Indirect, ASpotInAClosedRoomKeepsItsFlux) {
    constexpr double side = 3.0, rho = 0.8;
    const auto beam = cosine_power(10'000.0, 400.0), bulb = isotropic(100.0);
    const glm::dvec3 middle(1.2, 1.6, 1.4), at_wall(0.04, 1.0, 1.1);
    // Aims far from corners, where three nodes are too few.
    const LightSeed cases[] = {light_seed(beam, middle, orientation_of({0.5, 1.1, 0.0})),
                               light_seed(beam, middle, orientation_of({1.5, 1.1, 0.0})),
                               light_seed(beam, middle, orientation_of({3.5, 1.1, 0.0})), light_seed(bulb, at_wall)};
    for (const LightSeed& light : cases) {
        Renderer renderer(context(), direct_light());
        make_coarse(renderer);
        const Scene scene = scene_of_pieces(box({0, 0, 0}, glm::dvec3(side), rho, true), {light});
        const double expected = rho * light.profile->flux_lm / (6.0 * side * side * (1.0 - rho));
        double mean = 0.0;
        constexpr int kEach = 3;  // nodes of Gauss and Legendre along each edge
        const double at[kEach] = {0.5 - 0.5 * std::sqrt(0.6), 0.5, 0.5 + 0.5 * std::sqrt(0.6)},
                     weight[kEach] = {5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};
        for (int face = 0; face < 6; ++face) {
            const int axis = face / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
            for (int i = 0; i < kEach; ++i) {
                for (int k = 0; k < kEach; ++k) {
                    glm::dvec3 point(0.0), normal(0.0);
                    normal[axis] = face % 2 == 0 ? 1.0 : -1.0;
                    point[axis] = face % 2 == 0 ? 1e-3 : side - 1e-3;
                    point[u] = side * at[i], point[v] = side * at[k];
                    mean += weight[i] * weight[k] / 6.0 *
                            renderer.meter(scene, point, normal, Quality::interactive).indirect_lx();
                }
            }
        }
        EXPECT_NEAR(mean, expected, 0.03 * expected) << light.profile->name << ", case " << &light - cases;
    }
}

// Whatever light falls on the wall of a sphere, one bounce spreads it evenly: rho Phi / (4 pi R²). Here most of it
// falls on the small surfels around a bulb 5 cm from the wall, and few of a far meter's links would meet those.
TEST(Indirect, ABulbAtTheWallOfASphere) {
    Renderer renderer(context(), direct_light());
    const auto bulb = isotropic(1000.0);
    const Scene scene = scene_with({{inward_sphere(2.0, 128), glm::vec3(0.5f)}}, bulb, {0, 0, 1.95});
    const double expected = 0.5 * bulb->flux_lm / (16.0 * std::numbers::pi);
    for (const glm::dvec3& d : {glm::dvec3{0, 0, -1}, {1, 0, 0}, {0.0, 0.8, -0.6}, {-0.6, 0.0, 0.8}}) {
        const auto reading = renderer.meter(scene, d * 1.999, -d, Quality::interactive, 1);
        EXPECT_NEAR(reading.indirect_lx(), expected, 0.02 * expected) << d.x << "," << d.y << "," << d.z;
        const auto all = renderer.meter(scene, d * 1.999, -d, Quality::interactive);
        EXPECT_NEAR(all.indirect_lx(), 2.0 * expected, 0.03 * expected) << d.x << "," << d.y << "," << d.z;
    }
}

// A meter looks through an opening of 5 cm in a black screen at a floor around a bulb. Of the bright spot it sees a
// square, and small surfels at its edges in part. Expected: that square's light by quadrature.
TEST(Indirect, ABrightSpotBehindAnOpening) {
    constexpr double kHalf = 0.025, kScreen = 0.5, kEye = 1.0, kBulb = 0.05, kRho = 0.5, kCd = 1000.0;
    const auto strip = [](double x0, double x1, double z0, double z1) {
        return quad({x0, kScreen, z1}, {x1, kScreen, z1}, {x1, kScreen, z0}, {x0, kScreen, z0});
    };
    const Scene scene =
        scene_with({{quad({-2, 0, 2}, {2, 0, 2}, {2, 0, -2}, {-2, 0, -2}), glm::vec3(static_cast<float>(kRho))},
                    {strip(-2, -kHalf, -2, 2), glm::vec3(0.0f)},
                    {strip(kHalf, 2, -2, 2), glm::vec3(0.0f)},
                    {strip(-kHalf, kHalf, -2, -kHalf), glm::vec3(0.0f)},
                    {strip(-kHalf, kHalf, kHalf, 2), glm::vec3(0.0f)}},
                   isotropic(kCd), {0, kBulb, 0});
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    for (const double x : {0.0, 0.03, 0.06, 0.12}) {
        const double width = 2.0 * kHalf * kEye / (kEye - kScreen), left = -x - 0.5 * width;
        constexpr int kCells = 400;
        double expected = 0.0;
        for (int i = 0; i < kCells; ++i) {
            for (int k = 0; k < kCells; ++k) {
                const double u = left + width * (i + 0.5) / kCells, v = width * ((k + 0.5) / kCells - 0.5);
                const double floor_lx = kCd * kBulb / std::pow(kBulb * kBulb + u * u + v * v, 1.5),
                             d2 = kEye * kEye + (u - x) * (u - x) + v * v;
                expected += kRho * floor_lx * kEye * kEye / (std::numbers::pi * d2 * d2) * std::pow(width / kCells, 2);
            }
        }
        const auto reading = renderer.meter(scene, {x, kEye, 0}, {0, -1, 0}, Quality::interactive, 1);
        EXPECT_NEAR(reading.indirect_lx(), expected, 0.04 * expected + 2.0 * reading.indirect_error_lx()) << x;
        EXPECT_LT(reading.indirect_error_lx(), 0.1 * expected) << x;
    }
}

// A pane stops rays as often as links, so what a bulb next to it brings it is what the path tracer finds.
TEST(Indirect, ABulbNextToAPane) {
    std::vector<Placed> pieces = box({0, 0, 0}, glm::dvec3(3.0), 0.5, true);
    Material pane = matte(0.9);
    pane.alpha_blend = true, pane.base_color.a = 0.2f;
    pieces.push_back({quad({1.5, 0, 0}, {1.5, 0, 3}, {1.5, 3, 3}, {1.5, 3, 0})});
    pieces.back().material = pane;
    const Scene scene = scene_of_pieces(std::move(pieces), {light_seed(isotropic(100.0), {1.45, 1.5, 1.5})});
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    const auto world = trace::make_world(scene);
    const std::vector<trace::MeterPoint> points = {{{0.0, 1.0, 1.2}, {1, 0, 0}, trace::Receives::plane},
                                                   {{3.0, 1.7, 1.0}, {-1, 0, 0}, trace::Receives::plane},
                                                   {{0.8, 0.0, 1.9}, {0, 1, 0}, trace::Receives::plane}};
    trace::Settings settings;
    settings.noise = 0.004;
    const auto truth = trace::measure(*world, points, settings);
    for (std::size_t i = 0; i < points.size(); ++i) {
        const double expected = trace::luminance(truth[i].indirect_lx),
                     live = renderer.meter(scene, points[i].position, points[i].normal, Quality::interactive)
                                .indirect_lx();
        EXPECT_NEAR(live, expected, 0.02 * expected) << "point " << i;
    }
}

// A surface shows the light on its shading normal, not the flux that it takes. Those of a floor lean by 40°: a
// luminaire close above it, or a narrow beam, lights what is around by
//   ∫ rho / pi · I cos(shading normal, light) / r² · cos cos / d² dA.
TEST(Indirect, ShadingNormalsSayHowMuchANearLuminaireLights) {
    constexpr double kRho = 0.8, kPi = std::numbers::pi, kHalf_m = 2.0;
    const glm::dvec3 leans(std::sin(40.0 * kPi / 180.0), std::cos(40.0 * kPi / 180.0), 0.0), point(0.3, 1.0, 0.4);
    struct Case {
        double candela, power, height_m;  // I = candela × cos^power
    };
    for (const Case& c : {Case{500.0, 0.0, 0.07}, Case{1000.0, 500.0, 2.0}}) {
        Scene scene =
            floor_scene(2.0 * kHalf_m, static_cast<float>(kRho), cosine_power(c.candela, c.power), {0, c.height_m, 0});
        auto asset = std::make_shared<SceneAsset>(*scene.asset);
        for (Vertex& vertex : asset->meshes[0].vertices) vertex.normal = glm::vec3(leans);
        scene.asset = asset;
        renew(scene);
        double expected = 0.0;
        constexpr int kAngles = 1000, kTurns = 360;
        const double widest = std::atan(kHalf_m * std::numbers::sqrt2 / c.height_m);
        for (int i = 0; i < kAngles; ++i) {
            const double angle = widest * (i + 0.5) / kAngles, radius = c.height_m * std::tan(angle);
            for (int k = 0; k < kTurns; ++k) {
                const double turn = 2.0 * kPi * (k + 0.5) / kTurns;
                const glm::dvec3 at(radius * std::cos(turn), 0.0, radius * std::sin(turn)),
                    to_light = glm::dvec3(0, c.height_m, 0) - at, to_point = point - at;
                if (std::abs(at.x) > kHalf_m || std::abs(at.z) > kHalf_m) continue;
                const double r = glm::length(to_light), d = glm::length(to_point),
                             area_m2 = radius * c.height_m / std::pow(std::cos(angle), 2.0) * (widest / kAngles) *
                                       (2.0 * kPi / kTurns),
                             lux = c.candela * std::pow(std::cos(angle), c.power) *
                                   std::max(0.0, glm::dot(leans, to_light) / r) / (r * r);
                expected += kRho / kPi * lux * std::pow(to_point.y / d, 2.0) / (d * d) * area_m2;
            }
        }
        Renderer renderer(context(), direct_light());
        make_coarse(renderer);
        EXPECT_NEAR(renderer.meter(scene, point, {0, -1, 0}, Quality::interactive, 1).indirect_lx() / expected, 1.0,
                    0.04)
            << c.height_m;
        trace::Settings settings;
        settings.noise = 0.005;
        const trace::MeterPoint meter{point, {0, -1, 0}};
        const double traced =
            trace::luminance(trace::measure(*trace::make_world(scene), {&meter, 1}, settings).front().indirect_lx);
        EXPECT_NEAR(traced / expected, 1.0, 0.02) << c.height_m;
    }
}

TEST(Indirect, AFlatPlaneAloneLightsNothing) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    const Scene scene = floor_scene(10.0, 0.8f, isotropic(1000.0), {0, 2, 0});
    for (const Quality quality : {Quality::interactive, Quality::rsm}) {
        EXPECT_EQ(renderer.meter(scene, {0.5, 0, 0.2}, {0, 1, 0}, quality).indirect_lx(), 0.0);
    }
}

// Total flux of all RSM texels of a white closed surface is the luminaire's flux, however it is turned: solid angles,
// cube seams and the mask at once.
TEST(Indirect, TurningTheLuminaireKeepsItsFlux) {
    for (const auto& profile : {cosine_power(1000.0, 30.0), as_point(*builtin_profile("narrow_spot")),
                                as_point(*builtin_profile("street"))}) {
        Renderer renderer(context(), direct_light());
        make_coarse(renderer);
        Scene scene = scene_with({{inward_sphere(3.0, 64), glm::vec3(1.0f)}}, profile, {0.3, 0.1, -0.2});
        for (int k = 0; k < 12; ++k) {
            scene.lights[0].world_from_light = orientation_of({0.7 * k, 0.13 + 0.41 * k, 1.1 * k});
            scene.lights[0].aim_rev = ++scene.scene_rev;
            const auto flux = renderer.capture(scene, View::rsm_flux, 4 * kRsmSize, 3 * kRsmSize, true);
            double sum = 0.0;
            for (std::size_t i = 0; i < flux->values.size(); i += 4) sum += static_cast<double>(flux->values[i]);
            EXPECT_NEAR(sum * profile->peak_cd, profile->flux_lm, 0.005 * profile->flux_lm)
                << profile->name << " turn " << k;
        }
    }
}

// The IES light mask integrates to the flux of the web.
TEST(Indirect, MaskIntegratesToTheFlux) {
    for (const char* name : {"downlight", "wall_washer", "bulb", "linear"}) {
        Renderer renderer(context(), direct_light());
        make_coarse(renderer);
        const auto profile = as_point(*builtin_profile(name));
        const Scene scene = floor_scene(4.0, 0.5f, profile, {0, 2, 0}, orientation_of({0.4, 0.9, 0.2}));
        constexpr int n = 256;  // sampled at its own centres, bilinear between the mask's texels
        const auto mask = renderer.capture(scene, View::mask, 4 * n, 3 * n, true);
        double flux = 0.0;
        for (std::size_t y = 0; y < 3 * n; ++y) {
            for (std::size_t x = 0; x < 4 * n; ++x) {
                const double s = 2.0 * (static_cast<double>(x % n) + 0.5) / n - 1,
                             t = 2.0 * (static_cast<double>(y % n) + 0.5) / n - 1;
                flux += static_cast<double>(mask->values[(y * 4 * n + x) * 4]) * 4.0 /
                        (n * n * std::pow(1 + s * s + t * t, 1.5));
            }
        }
        EXPECT_NEAR(flux, profile->flux_lm, 0.005 * profile->flux_lm) << name;
    }
}

// Points on the surfaces of the Cornell room, in and out of the blocks' shadow of the bounce: the first bounce, and
// all.
TEST(Indirect, AgreesWithTheReference) {
    Renderer renderer(context(), direct_light());
    const Scene scene = scene_of(builtin("cornell"));
    const std::vector<trace::MeterPoint> points = {
        {{-1.999, 1.0, 0.5}, {1, 0, 0}}, {{1.999, 2.2, 0.0}, {-1, 0, 0}},  {{0.0, 3.999, 0.9}, {0, -1, 0}},
        {{0.5, 2.5, -1.999}, {0, 0, 1}}, {{-1.4, 0.001, 1.2}, {0, 1, 0}},  {{-0.5, 3.999, -1.0}, {0, -1, 0}},
        {{1.999, 3.0, 1.2}, {-1, 0, 0}}, {{-1.999, 2.8, -1.0}, {1, 0, 0}}, {{0.0, 0.001, -1.2}, {0, 1, 0}},
        {{-1.3, 0.001, 0.1}, {0, 1, 0}}, {{0.3, 0.5, -1.999}, {0, 0, 1}}};
    for (const int bounces : {1, trace::kAllBounces}) {
        trace::Settings settings;
        settings.bounces = bounces;
        settings.noise = 0.002;
        const auto truth = trace::measure(*trace::make_world(scene), points, settings);
        double squares = 0.0, excess = 0.0, sum = 0.0;
        for (std::size_t i = 0; i < points.size(); ++i) {
            const auto reading =
                renderer.meter(scene, points[i].position, points[i].normal, Quality::interactive, bounces);
            const double wanted = glm::dot(truth[i].indirect_lx, glm::dvec3(0.2126, 0.7152, 0.0722)),
                         off = reading.indirect_lx() - wanted;
            squares += std::pow(off / wanted, 2.0);
            excess += off;
            sum += wanted;
            EXPECT_LT(std::abs(off), 3.0 * reading.indirect_error_lx() + 3.0 * truth[i].indirect_error_lx) << i;
        }
        EXPECT_GT(renderer.transport_stats().bounces(), 1u) << "nobody looks on, and the meter has solved";
        const double rms = std::sqrt(squares / static_cast<double>(points.size()));
        std::printf("%s: rms error against the reference %.4f, bias %.4f\n",
                    bounces == 1 ? "one bounce" : "all bounces", rms, excess / sum);
        EXPECT_LT(rms, 0.03);
        EXPECT_LT(std::abs(excess / sum), 0.02);
    }
}

// Two public models with a bulb in each, where a bounce reaches closed-off parts late. The values are the path
// tracer's: of the garage as its case says, of the ball with a standard error of 0.001 lx (its case says 0.457).
TEST(PublicModels, ThoseThatRanAwayReadWhatTheReferenceReads) {
    struct Case {
        const char* file;
        glm::dvec3 bulb, at;
        double indirect_lx;
    };
    for (const Case& one :
         {Case{"garage/garage.gltf", {0, 2, 0}, {0, 0.01, -1}, 9.5},
          Case{"shader_ball/shader_ball.gltf", {-6.1004, 3.05855, 1.41727}, {-0.840421, -0.846641, 0.353943}, 0.430}}) {
        const auto file = shared_data(std::filesystem::path("cases/public") / one.file);
        if (!file) GTEST_SKIP() << "no shared cases on this machine";
        const auto asset = load_scene(*file);
        ASSERT_TRUE(asset) << asset.error().text();
        auto lit = std::make_shared<SceneAsset>(**asset);
        lit->lights = {light_seed(*builtin_profile("bulb"), one.bulb)};
        const Scene scene = scene_of(lit);
        Renderer renderer(context(), direct_light());
        const auto read = [&] { return renderer.meter(scene, one.at, {0, 1, 0}, Quality::interactive); };
        while (renderer.ready(scene) != Readiness::all) read();
        const auto reading = read();
        EXPECT_NEAR(reading.indirect_lx(), one.indirect_lx, 0.05 * one.indirect_lx) << one.file;
        EXPECT_LT(reading.indirect_error_lx(), 0.1 * one.indirect_lx) << one.file;
    }
}

// A closed partition: what lies behind it receives nothing of the bounce.
TEST(Indirect, ASealedRoomStaysDark) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    const auto wall = [](double z, double facing) {
        return facing > 0 ? quad({-9, 0, z}, {9, 0, z}, {9, 9, z}, {-9, 9, z})
                          : quad({9, 0, z}, {-9, 0, z}, {-9, 9, z}, {9, 9, z});
    };
    Scene scene = scene_with({{quad({-9, 0, 9}, {9, 0, 9}, {9, 0, -9}, {-9, 0, -9}), glm::vec3(0.8f)},
                              {wall(0.0, 1), glm::vec3(0.8f)},
                              {wall(-0.1, -1), glm::vec3(0.8f)},
                              {wall(-8.0, 1), glm::vec3(0.8f)}},
                             isotropic(1000.0), {0, 2, 2});
    EXPECT_GT(renderer.meter(scene, {0, 0, 1}, {0, 1, 0}, Quality::interactive).indirect_lx(), 1.0);
    EXPECT_EQ(renderer.meter(scene, {0, 0, -1}, {0, 1, 0}, Quality::interactive).indirect_lx(), 0.0);
    scene.camera = {{0, 6, -4.001}, {0, 0, -4}, 0.7};  // the dark side, from above
    const auto picture = renderer.capture(scene, View::illuminance, 64, 64, true);
    float greatest = 0.0f;
    for (std::size_t i = 0; i < picture->values.size(); i += 4) greatest = std::max(greatest, picture->values[i]);
    EXPECT_EQ(greatest, 0.0f);
}

// Swept into contact with a bright wall the reading stays finite and never exceeds the wall's exitance rho · E.
TEST(Indirect, ContactIsBounded) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    const Scene scene = scene_with({{quad({-3, 0, 3}, {3, 0, 3}, {3, 0, -3}, {-3, 0, -3}), glm::vec3(0.8f)},
                                    {quad({-3, 0, -3}, {3, 0, -3}, {3, 3, -3}, {-3, 3, -3}), glm::vec3(0.8f)}},
                                   isotropic(1000.0), {0, 1.5, -1.5});
    const double exitance = 0.8 * 1000.0 / (1.5 * 1.5);  // the wall's brightest point
    for (double gap : {1.0, 0.3, 0.1, 0.03, 0.01, 1e-3, 1e-4, 1e-5}) {
        const double lux =
            renderer.meter(scene, {0.0, 1.5, -3.0 + gap}, {0, 0, -1}, Quality::interactive, 1).indirect_lx();
        EXPECT_TRUE(std::isfinite(lux));
        EXPECT_GE(lux, 0.0);
        EXPECT_LE(lux, 1.05 * exitance) << gap;
    }
}

TEST(Indirect, ADarkProfileAndAMillionCandelaAreBothFinite) {
    const Scene room = scene_with({{inward_sphere(2.0, 64), glm::vec3(0.5f)}}, isotropic(1.0), {0.1, 0, 0});
    for (double candela : {0.0, 1e-30, 1e6, 1e12}) {
        Renderer renderer(context(), direct_light());
        make_coarse(renderer);
        Scene scene = room;
        scene.lights[0].profile = isotropic(candela);
        const auto reading = renderer.meter(scene, {2, 0, 0}, {-1, 0, 0}, Quality::interactive);
        EXPECT_TRUE(std::isfinite(reading.total_lx())) << candela;
        // All bounces of rho = 0.5: once more than the first.
        const double expected = 4 * std::numbers::pi * candela / (16 * std::numbers::pi);
        EXPECT_NEAR(reading.indirect_lx(), expected, 0.02 * expected) << candela;
        renderer.begin_frame(scene, monotonic_ns());
        EXPECT_TRUE(renderer.finish_frame(true)->nv12);
    }
}

// The seed paper's estimator is unbiased over the whole sphere: its mean over a picture of the integrating sphere.
TEST(Indirect, SeedTechniqueReadsTheSphereInTheMean) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    const auto profile = cosine_power(1000.0, 2.0);
    Scene scene = scene_with({{inward_sphere(2.0, 128), glm::vec3(0.5f)}}, profile, {0.3, 0.2, 0.0});
    scene.technique = Technique::seed;
    scene.samples = 400;
    scene.camera = {{0, 0, 0.0}, {0, 0, -1}, 1.2};
    double sum = 0.0;
    const auto beauty = renderer.capture(scene, View::indirect, 64, 64, true);  // rho / pi × indirect lux
    for (std::size_t i = 0; i < beauty->values.size(); i += 4)
        sum += static_cast<double>(beauty->values[i]) * std::numbers::pi / 0.5;
    const double expected = 0.5 * profile->flux_lm / (16 * std::numbers::pi);
    EXPECT_NEAR(sum / (64 * 64), expected, 0.01 * expected);
}

// Both readings of the seed paper against the sum that both estimate: the whole sphere has the lower error, so it is
// the one that `--technique seed` means. Root mean square over the picture, relative to its mean.
TEST(Indirect, SeedOverTheSphereBeatsSeedInADisk) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    Scene scene = scene_of(builtin("cornell"));
    const auto picture = [&](Technique technique, unsigned samples) {
        scene.technique = technique;
        scene.samples = samples;
        ++scene.scene_rev;
        return renderer.capture(scene, View::indirect, 64, 64, true, 1)->values;
    };
    const std::vector<float> truth = picture(Technique::standard, 4096);
    const auto error = [&](const std::vector<float>& values) {
        double mean = 0.0, squares = 0.0;
        std::vector<double> errors;
        for (std::size_t i = 1; i < truth.size(); i += 4) {
            mean += static_cast<double>(truth[i]);
            errors.push_back(std::pow(static_cast<double>(values[i] - truth[i]), 2.0));
        }
        // Without the worst 1 %: the bare kernel's spikes near contact are in both.
        std::sort(errors.begin(), errors.end());
        errors.resize(errors.size() * 99 / 100);
        for (double e : errors) squares += e;
        const double n = static_cast<double>(errors.size());
        return std::sqrt(squares / n) / (mean / n);
    };
    const double sphere = error(picture(Technique::seed, 400)), disk = error(picture(Technique::seed_disk, 400));
    std::printf("seed 400: relative rms error %.3f over the sphere, %.3f in a disk\n", sphere, disk);
    EXPECT_LT(sphere, disk);
}

}  // namespace
}  // namespace gonio::test
