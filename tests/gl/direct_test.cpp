// Direct light against I(θ) cos / d², from the meter and from the pixels of the illuminance picture.
#include "protocol/schema/command.pb.h"
#include "server/assets/assets.h"
#include "server/scene/scene.h"
#include "tests/gl/test_context.h"
#include "tests/scenes/show.h"

namespace gonio::test {
namespace {

double meter_direct(Renderer& renderer, const Scene& scene, const glm::dvec3& point, const glm::dvec3& normal) {
    return renderer.meter(scene, point, normal, Renderer::MeterQuality::interactive).direct_lx();
}

TEST(Direct, IsotropicThousandCandelaTwoMetresAboveAFloorGives250Lux) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    const Scene scene = floor_scene(10.0, 0.0f, isotropic(1000.0), {0, 2, 0});
    EXPECT_NEAR(meter_direct(renderer, scene, {0, 0, 0}, {0, 1, 0}), 250.0, 0.25);
}

// CIE 171:2006 case 5.2, closed form I0·9/(9+r²)² for a Lambertian point source 3 m above the floor, I0 = 1000 cd.
TEST(Direct, Cie171Case52) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    const Scene scene = floor_scene(8.0, 0.0f, cosine_power(1000.0, 1.0), {0, 3, 0});
    for (const glm::dvec2 p : {glm::dvec2{0, 0},
                               {0.5, 0},
                               {1, 0},
                               {1.5, 0},
                               {0.5, 0.5},
                               {1, 0.5},
                               {1.5, 0.5},
                               {1, 1},
                               {1.5, 1},
                               {1.5, 1.5}}) {
        const double r2 = glm::dot(p, p), expected = 1000.0 * 9.0 / ((9.0 + r2) * (9.0 + r2));
        EXPECT_NEAR(meter_direct(renderer, scene, {p.x, 0, p.y}, {0, 1, 0}), expected, 0.002 * expected)
            << p.x << "," << p.y;
    }
}

// I = 1000 cos²: E at 0, 1, 2 and 4 m follows cos² · cos / d²; a table that is squared by mistake does not.
TEST(Direct, CosineSquaredIsNotSquaredAgain) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    const Scene scene = floor_scene(20.0, 0.0f, cosine_power(1000.0, 2.0), {0, 2, 0});
    for (double x : {0.0, 1.0, 2.0, 4.0}) {
        const double d2 = x * x + 4.0, c = 2.0 / std::sqrt(d2), expected = 1000.0 * c * c * c / d2;
        EXPECT_NEAR(meter_direct(renderer, scene, {x, 0, 0}, {0, 1, 0}), expected, 0.002 * expected) << x;
    }
}

// Expected value without the program's own orientation code: aim and C0 written out from pan, tilt and roll.
double expected_lux(const Profile& profile, const glm::dvec3& light, double pan, double tilt, double roll,
                    const glm::dvec3& point, const glm::dvec3& normal) {
    const glm::dvec3 aim(-std::sin(tilt) * std::sin(pan), -std::cos(tilt), -std::sin(tilt) * std::cos(pan));
    const auto panned_tilted = [&](const glm::dvec3& v) {  // R_Y(pan) R_X(tilt) v
        const glm::dvec3 t(v.x, v.y * std::cos(tilt) - v.z * std::sin(tilt),
                           v.y * std::sin(tilt) + v.z * std::cos(tilt));
        return glm::dvec3(t.x * std::cos(pan) + t.z * std::sin(pan), t.y, -t.x * std::sin(pan) + t.z * std::cos(pan));
    };
    const glm::dvec3 c0 = panned_tilted({std::cos(roll), 0, -std::sin(roll)}),
                     c90 = panned_tilted({-std::sin(roll), 0, -std::cos(roll)});
    const glm::dvec3 d = glm::normalize(point - light);
    const double v = std::acos(std::clamp(glm::dot(d, aim), -1.0, 1.0));
    double h = std::atan2(glm::dot(d, c90), glm::dot(d, c0));
    if (h < 0) h += 2 * std::numbers::pi;
    const double candela =
        ies::intensity(profile.photometry.web, {std::sin(v) * std::cos(h), std::sin(v) * std::sin(h), -std::cos(v)})
            .in(cd);
    return candela * std::max(0.0, -glm::dot(d, normal)) / glm::dot(point - light, point - light);
}

// Twenty points, three synthetic luminaires, each turned another way: meter within 0.5 %, picture within 1 % of the
// meter.
TEST(Direct, TurnedLuminairesAtTwentyPointsInMeterAndPicture) {
    struct Turn {
        const char* profile;
        double pan, tilt, roll;
    };
    for (const Turn& turn :
         {Turn{"downlight", 0.3, 0.4, 0.9}, Turn{"wall_washer", -1.1, 0.5, 2.2}, Turn{"batwing", 2.0, 0.7, -0.6}}) {
        Renderer renderer(context(), direct_light());
        make_coarse(renderer);
        const auto profile = as_point(*builtin_profile(turn.profile));
        const glm::dvec3 light(0.4, 3.0, -0.3);
        Scene scene = floor_scene(40.0, 0.0f, profile, light, orientation_of({turn.pan, turn.tilt, turn.roll}));
        scene.camera = {{0.0, 9.0, 0.001}, {0.0, 0.0, 0.0}, 0.9};
        const int size = 512;
        const auto picture = renderer.capture(scene, View::illuminance, size, size, true);
        ASSERT_TRUE(picture);
        const Eye eye = eye_of(scene.camera, size, size);
        int lit = 0;
        for (int k = 0; k < 20; ++k) {
            // The centre of a pixel, so that meter and picture look at the same point.
            const int px = 60 + 97 * k % 390, py = 60 + 173 * k % 390;
            const glm::dvec2 at((px + 0.5) / size * 2 - 1, 1 - (py + 0.5) / size * 2);
            const glm::dvec3 ray = ray_through(eye, at.x, at.y);
            const glm::dvec3 point = eye.position - ray * (eye.position.y / ray.y);
            const double expected = expected_lux(*profile, light, turn.pan, turn.tilt, turn.roll, point, {0, 1, 0});
            const double metered = meter_direct(renderer, scene, {point.x, 0, point.z}, {0, 1, 0});
            EXPECT_NEAR(metered, expected, 0.005 * expected + 1e-4)
                << turn.profile << " at " << point.x << "," << point.z;
            const double shown = static_cast<double>(picture->values[static_cast<std::size_t>(py * size + px) * 4]);
            EXPECT_NEAR(shown, metered, 0.01 * metered + 1e-4) << turn.profile << " pixel " << px << "," << py;
            if (expected > 1.0) ++lit;
        }
        EXPECT_GE(lit, 10) << turn.profile << " must light most of the points, or the test shows nothing";
    }
}

// A beam without any symmetry, whose law is known: the expected lux come from the law, no table and no lookup between.
TEST(Direct, AnAsymmetricLawTurnedEveryWay) {
    const auto law = [](double v, double h) {
        return v < std::numbers::pi / 2
                   ? 1000.0 * std::cos(v) * (1.0 + std::sin(v) * (0.5 * std::sin(h) + 0.2 * std::cos(h)))
                   : 0.0;
    };
    const auto profile = profile_of("asymmetric", 1.0, law);
    const glm::dvec3 light(0.4, 3.0, -0.3);
    for (const PanTiltRoll& turn : {PanTiltRoll{0, 0, 0}, {0, 0, 1.0}, {0.8, 0.4, 0.0}, {-2.0, 0.7, 2.5}}) {
        Renderer renderer(context(), direct_light());
        make_coarse(renderer);
        const Scene scene = floor_scene(40.0, 0.0f, profile, light, orientation_of(turn));
        // C0 and C90 written out from pan, tilt and roll, as in expected_lux.
        const glm::dvec3 aim(-std::sin(turn.tilt_rad) * std::sin(turn.pan_rad), -std::cos(turn.tilt_rad),
                             -std::sin(turn.tilt_rad) * std::cos(turn.pan_rad));
        const glm::dvec3 x(std::cos(turn.pan_rad), 0.0, -std::sin(turn.pan_rad)), z = glm::cross(x, -aim);
        const glm::dvec3 c0 = x * std::cos(turn.roll_rad) - z * std::sin(turn.roll_rad), c90 = glm::cross(-aim, c0);
        for (const glm::dvec2 at : {glm::dvec2{1.5, 0.0}, {-1.0, 0.8}, {0.2, -1.7}, {0.6, 1.9}, {-1.8, -1.2}}) {
            const glm::dvec3 point(at.x, 0.0, at.y), d = glm::normalize(point - light);
            const double v = std::acos(glm::dot(d, aim)), h = std::atan2(glm::dot(d, c90), glm::dot(d, c0));
            const double expected = law(v, h) * -d.y / glm::dot(point - light, point - light);
            EXPECT_NEAR(meter_direct(renderer, scene, point, {0, 1, 0}), expected, 0.003 * expected + 1e-3)
                << turn.pan_rad << " " << turn.tilt_rad << " " << turn.roll_rad << " at " << at.x << "," << at.y;
        }
    }
}

TEST(Direct, APlaneDoesNotShadowItselfAtGrazingAngles) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    const Scene scene = floor_scene(60.0, 0.0f, isotropic(1000.0), {0, 1, 0});
    for (double x : {0.1, 1.0, 3.0, 10.0, 25.0}) {
        const double expected = 1000.0 / std::pow(x * x + 1.0, 1.5);
        EXPECT_NEAR(meter_direct(renderer, scene, {x, 0, 0.2}, {0, 1, 0}), 1000.0 / std::pow(x * x + 0.04 + 1.0, 1.5),
                    0.005 * expected)
            << x;
    }
}

// A board that faces the luminaire squarely, in directions where its plane slants across the face of the shadow cube:
// every pixel of the picture that a shadow cube lights shows I cos³ / h², no stripes of the board's own shadow.
TEST(Direct, ABoardFacingTheLightOffTheCubesAxesDoesNotShadowItself) {
    const glm::dvec3 from(0.1, 0.2, 0.3);
    for (const glm::dvec3& towards : {glm::dvec3{1, 1, 1}, {1, -1, 0}, {-0.7, -0.7, 0.2}, {0.2, 1, 0.9}}) {
        Renderer renderer(context(), Renderer::DirectLight::gl);
        make_coarse(renderer);
        const glm::dvec3 d = glm::normalize(towards), x = glm::normalize(glm::cross(d, glm::dvec3(0, 1, 0.1))),
                         y = glm::cross(x, d);
        const double h = 3.0;
        const glm::dvec3 c = from + d * h;
        Scene scene =
            scene_with({{quad(c - x - y, c + x - y, c + x + y, c - x + y), glm::vec3(0)}}, isotropic(1000.0), from);
        scene.camera = {c - d * 1.5, c, 0.8};
        const int n = scene.width_px = scene.height_px = 96;
        show(renderer, scene);
        const auto light = renderer.live_illuminance(scene, false);  // rows from the bottom
        const Eye eye = eye_of(scene.camera, n, n);
        double worst = 0.0;
        for (int j = 0; j < n; ++j) {
            for (int i = 0; i < n; ++i) {
                const glm::dvec2 at((i + 0.5) / n * 2 - 1, (j + 0.5) / n * 2 - 1);
                const glm::dvec3 p = eye.position + 1.5 * ray_through(eye, at.x, at.y);
                const double expected = 1000.0 * h / std::pow(glm::distance(p, from), 3.0);
                const double shown = static_cast<double>(light[static_cast<std::size_t>(j * n + i)].g);
                worst = std::max(worst, std::abs(shown / expected - 1.0));
            }
        }
        EXPECT_LT(worst, 0.005) << towards.x << "," << towards.y << "," << towards.z;
    }
}

TEST(Direct, AWallCastsAShadowFromBothSides) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    for (const bool flipped : {false, true}) {
        const glm::dvec3 a(-1, 1, 1), b(1, 1, 1), c(1, 1, -1), d(-1, 1, -1);
        Scene scene = scene_with({{quad({-5, 0, 5}, {5, 0, 5}, {5, 0, -5}, {-5, 0, -5}), glm::vec3(0)},
                                  {flipped ? quad(d, c, b, a) : quad(a, b, c, d), glm::vec3(0)}},
                                 isotropic(1000.0), {0, 2, 0});
        EXPECT_EQ(meter_direct(renderer, scene, {0, 0, 0}, {0, 1, 0}), 0.0);
        EXPECT_EQ(meter_direct(renderer, scene, {1.9, 0, 0}, {0, 1, 0}), 0.0);
        EXPECT_NEAR(meter_direct(renderer, scene, {2.1, 0, 0}, {0, 1, 0}), 2000.0 / std::pow(4.0 + 2.1 * 2.1, 1.5),
                    0.5);
    }
}

TEST(Direct, TwoHalvesMakeOneWhole) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    Scene one = floor_scene(10.0, 0.5f, isotropic(1000.0), {0.3, 2, 0});
    Scene two = floor_scene(10.0, 0.5f, isotropic(500.0), {0.3, 2, 0});
    two.lights.push_back(two.lights[0]);
    two.lights[1].id = two.next_light_id++;
    const auto a = renderer.meter(one, {0, 0, 0}, {0, 1, 0}, Renderer::MeterQuality::interactive);
    Renderer other(context());
    const auto b = other.meter(two, {0, 0, 0}, {0, 1, 0}, Renderer::MeterQuality::interactive);
    EXPECT_NEAR(a.total_lx(), b.total_lx(), 1e-4 * a.total_lx());
}

TEST(Direct, LevelMultiplierColourAndMasterMultiply) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    Scene scene = floor_scene(10.0, 0.0f, isotropic(1000.0), {0, 2, 0});
    scene.lights[0].level_ratio = 0.5;
    scene.lights[0].multiplier = 3.0;
    scene.lights[0].color = {1.0, 0.5, 0.25};
    scene.master_ratio = 0.8;
    const auto reading = renderer.meter(scene, {0, 0, 0}, {0, 1, 0}, Renderer::MeterQuality::interactive);
    const double base = 250.0 * 0.5 * 3.0 * 0.8;
    EXPECT_NEAR(reading.direct_rgb_lx(0), base, 0.3);
    EXPECT_NEAR(reading.direct_rgb_lx(1), base * 0.5, 0.3);
    EXPECT_NEAR(reading.direct_rgb_lx(2), base * 0.25, 0.3);
    EXPECT_NEAR(reading.direct_lx(), base * (0.2126 + 0.7152 * 0.5 + 0.0722 * 0.25), 0.3);
}

// A tint is a colour of luminance 1: what it does to each channel is in tests/unit/scene/white_test.cpp.
TEST(Direct, ATintKeepsTheLux) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    Scene scene = floor_scene(10.0, 0.0f, isotropic(1000.0), {0, 2, 0});
    for (const double duv : {-0.05, 0.05}) {
        scene.lights[0].tint_duv = duv;
        const auto reading = renderer.meter(scene, {0, 0, 0}, {0, 1, 0}, Renderer::MeterQuality::interactive);
        EXPECT_NEAR(reading.direct_lx(), 250.0, 0.3) << duv;
        EXPECT_EQ(reading.direct_rgb_lx(1) > 250, duv > 0) << "green above, magenta below";
    }
}

// E = I/d² = 250 lx at every colour temperature; behind a gel it is that times the published transmission.
TEST(Direct, AColourTemperatureKeepsTheLuxAndAGelTakesItsShare) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    Scene scene = floor_scene(10.0, 0.0f, isotropic(1000.0), {0, 2, 0});
    const auto lux = [&](double cct_k, const char* gel) {
        v1::Command command;
        command.mutable_set_light()->set_name("light");
        command.mutable_set_light()->set_cct_k(cct_k);
        command.mutable_set_light()->set_gel(gel);
        EXPECT_TRUE(apply(scene, command, {}));
        return renderer.meter(scene, {0, 0, 0}, {0, 1, 0}, Renderer::MeterQuality::interactive);
    };
    for (const double cct_k : {1000.0, 2700.0, 8000.0, 15'000.0}) {
        const auto reading = lux(cct_k, "");
        EXPECT_NEAR(reading.direct_lx(), 250.0, 0.3) << cct_k;
        EXPECT_EQ(reading.direct_rgb_lx(0) > reading.direct_rgb_lx(2), cct_k < 6500) << cct_k;
    }
    // LEE Filters with 3,200 K: 201 Full C.T. Blue 35.0 %, 204 Full C.T. Orange 62.8 %.
    EXPECT_NEAR(lux(3200, "L201").direct_lx(), 250.0 * 0.350, 0.4);
    EXPECT_NEAR(lux(3200, "L204").direct_lx(), 250.0 * 0.628, 0.6);
}

// LM-63 TILT=INCLUDE: the lamp gives 0.6 of its light when the luminaire is tilted by 60 degrees.
TEST(Direct, TheTiltFactorFollowsTheLuminairesTilt) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    auto profile = std::make_shared<Profile>(*isotropic(1000.0));
    profile->photometry.tilt = ies::TiltTable{1, {0.0, std::numbers::pi / 3, std::numbers::pi}, {1.0, 0.6, 0.6}};
    Scene scene = floor_scene(10.0, 0.0f, profile, {0, 2, 0});
    EXPECT_NEAR(meter_direct(renderer, scene, {0, 0, 0}, {0, 1, 0}), 250.0, 0.3);
    for (const auto& [tilt_deg, factor] : {std::pair{60.0, 0.6}, {30.0, 0.8}, {0.0, 1.0}}) {
        v1::Command command;
        command.mutable_set_light()->set_name("light");
        command.mutable_set_light()->set_tilt_rad(tilt_deg * std::numbers::pi / 180);
        ASSERT_TRUE(apply(scene, command, {}));
        EXPECT_NEAR(meter_direct(renderer, scene, {0, 0, 0}, {0, 1, 0}), 250.0 * factor, 0.3) << tilt_deg;
    }
}

// One Lambertian beam along the photometric zero, written on the grids of Types A, B and C, lights alike.
TEST(Direct, GoniometerTypesAgree) {
    for (const auto goniometer : {ies::Goniometer::type_c, ies::Goniometer::type_b, ies::Goniometer::type_a}) {
        auto profile = std::make_shared<Profile>();
        ies::PhotometricWeb& web = profile->photometry.web;
        web.goniometer = goniometer;
        const bool c = goniometer == ies::Goniometer::type_c;
        for (int i = 0; i <= 180; ++i) web.v_rad.push_back((c ? i : i - 90) * std::numbers::pi / 180);
        for (int i = 0; i <= (c ? 360 : 180); ++i) web.h_rad.push_back((c ? i : i - 90) * std::numbers::pi / 180);
        for (double h : web.h_rad) {
            for (double v : web.v_rad) {
                const double along = -ies::direction_of(goniometer, Angle::radians(v), Angle::radians(h))[2];
                web.candela.push_back(static_cast<float>(1000.0 * std::max(0.0, along)));
            }
        }
        profile->peak_cd = 1000.0;
        Renderer renderer(context(), direct_light());
        make_coarse(renderer);
        const Scene scene = floor_scene(10.0, 0.0f, profile, {0, 2, 0}, orientation_of({0.4, 0.5, 0.3}));
        const glm::dvec3 aim(-std::sin(0.5) * std::sin(0.4), -std::cos(0.5), -std::sin(0.5) * std::cos(0.4));
        for (const glm::dvec3& p : {glm::dvec3{0, 0, 0}, {0.7, 0, -1.1}, {-1.3, 0, 0.4}, {0.2, 0, -2.6}}) {
            const glm::dvec3 d = p - glm::dvec3(0, 2, 0);
            const double r = glm::length(d),
                         expected = 1000.0 * std::max(0.0, glm::dot(d, aim) / r) * (2.0 / r) / (r * r);
            EXPECT_NEAR(meter_direct(renderer, scene, p, {0, 1, 0}), expected, 0.003 * expected)
                << static_cast<int>(goniometer);
        }
    }
}

// Rebased in double: ten kilometres from the origin the same room reads the same lux.
TEST(Direct, TenKilometresAwayNothingChanges) {
    const glm::dvec3 away(10000.0, -3000.0, 7000.0);
    double lux[2];
    for (int k = 0; k < 2; ++k) {
        Renderer renderer(context(), direct_light());
        make_coarse(renderer);
        const glm::dvec3 offset = k == 0 ? glm::dvec3(0) : away;
        const Scene scene =
            scene_with({{quad({-3, 0, 3}, {3, 0, 3}, {3, 0, -3}, {-3, 0, -3}), glm::vec3(0.5f)},
                        {quad({-3, 0, -3}, {3, 0, -3}, {3, 3, -3}, {-3, 3, -3}), glm::vec3(0.5f)}},
                       cosine_power(1000.0, 2.0), {0.4, 2.5, 0.3}, orientation_of({0.2, 0.3, 0}), offset);
        lux[k] = renderer.meter(scene, glm::dvec3(0.7, 0.0, -0.4) + offset, {0, 1, 0}, Renderer::MeterQuality::rsm)
                     .total_lx();
    }
    EXPECT_NEAR(lux[1], lux[0], 0.001 * lux[0]);
}

// A capture is rendered in tiles through windows of the view: so large that it takes several, it shows what
// the meter reads at the pixels' points, seams or not.
TEST(Direct, TilesMakeOnePicture) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    Scene scene = floor_scene(20.0, 0.0f, cosine_power(1000.0, 1.0), {0.5, 2.5, 0.2});
    scene.camera = {{0.0, 6.0, 0.001}, {0.0, 0.0, 0.0}, 0.8};
    const int width = 600, height = 400;
    const auto job = renderer.begin_capture(scene, View::illuminance, width, height, true);
    int tiles = 1;
    while (!renderer.continue_capture(*job)) ++tiles;
    EXPECT_GE(tiles, 4);
    const Eye eye = eye_of(scene.camera, width, height);
    for (int y = 3; y < height; y += 23) {
        for (int x = 5; x < width; x += 29) {
            const glm::dvec2 at((x + 0.5) / width * 2 - 1, 1 - (y + 0.5) / height * 2);
            const glm::dvec3 ray = ray_through(eye, at.x, at.y);
            const glm::dvec3 p = eye.position - ray * (eye.position.y / ray.y);
            const double h = 2.5, d2 = glm::dot(p - glm::dvec3(0.5, h, 0.2), p - glm::dvec3(0.5, h, 0.2)),
                         c = h / std::sqrt(d2);
            const double expected = 1000.0 * c * c / d2;
            EXPECT_NEAR(static_cast<double>(job->picture->values[static_cast<std::size_t>(y * width + x) * 4]),
                        expected, 0.003 * expected)
                << x << "," << y;
        }
    }
}

TEST(Direct, EmittersShowTheirLuminanceAndTakeNoPartInIlluminance) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    Scene scene =
        scene_with({{quad({-5, 0, 5}, {5, 0, 5}, {5, 0, -5}, {-5, 0, -5}), glm::vec3(0.5f), glm::vec3(120.0f)}},
                   isotropic(1000.0), {0, 2, 0});
    scene.camera = {{0, 1.5, 0.001}, {0, 0, 0}, 0.2};
    const auto luminance = renderer.capture(scene, View::luminance, 33, 33, true);
    const auto illuminance = renderer.capture(scene, View::illuminance, 33, 33, true);
    const std::size_t centre = (16 * 33 + 16) * 4;
    EXPECT_NEAR(illuminance->values[centre], 250.0f, 1.5f);
    EXPECT_NEAR(luminance->values[centre], 120.0f + 0.5f * 250.0f / std::numbers::pi_v<float>, 0.5f);
}

// The sun's disc is beyond what 16-bit floats hold.
TEST(Direct, AnEmitterAsBrightAsTheSunKeepsItsLuminance) {
    for (const float nits : {1e5f, 1.6e9f}) {
        Renderer renderer(context());
        make_coarse(renderer);
        Scene scene =
            scene_with({{quad({-5, 0, 5}, {5, 0, 5}, {5, 0, -5}, {-5, 0, -5}), glm::vec3(0), glm::vec3(nits)}},
                       isotropic(1000.0), {0, 2, 0});
        scene.camera = {{0, 1.5, 0.001}, {0, 0, 0}, 0.2};
        EXPECT_NEAR(renderer.capture(scene, View::luminance, 9, 9, true)->values[0], nits, 1e-5f * nits);
    }
}

}  // namespace
}  // namespace gonio::test
