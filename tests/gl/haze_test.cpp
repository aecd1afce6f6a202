// Haze in the live picture, in stills and at meters, against closed forms and the reference; and what it costs.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "ies/web.h"
#include "protocol/schema/command.pb.h"
#include "protocol/schema/report.pb.h"
#include "server/scene/scene.h"
#include "server/trace/reference.h"
#include "tests/gl/test_context.h"
#include "tests/scenes/placed.h"
#include "tests/scenes/show.h"

namespace gonio::test {
namespace {

using ies::kPi;

// What a raw capture of the luminance view shows at its middle, cd/m².
double luminance_ahead(Renderer& renderer, const Scene& scene) {
    const auto picture = renderer.capture(scene, View::luminance, 33, 33, true);
    return static_cast<double>(picture->values[4 * (16 * 33 + 16)]);
}

// A plane that faces 100 cd in boundless haze: direct light and light from the air, by quadrature of
//   ∫ σ e^(−σr) p cos θ I / (r² t²) dV,
// r from the luminaire to the air and t from there to the plane. What is scattered again on t counts as if it arrived.
TEST(Haze, OntoAMeter) {
    const struct {
        double extinction, g, distance, direct, scattered;
    } rows[] = {{.02, 0.0, 3, 10.4641, 0.802829},    {.05, 0.0, 3, 9.56342, 1.863065},
                {.1, 0.0, 5, 2.42612, 1.774191},     {.02, 0.7, 3, 10.4641, 0.665316},
                {.05, 0.7, 3, 9.56342, 1.585072},    {.1, 0.7, 5, 2.42612, 1.598274},
                {.02, 0.0, .05, 39960.02, 51.32069}, {.02, 0.7, .05, 39960.02, 41.29242}};
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    for (const auto& row : rows) {
        Scene scene = floor_scene(0.02, 0.0f, isotropic(100.0), {0, row.distance, 0});
        scene.haze = {.extinction_per_m = row.extinction, .g = row.g};
        const v1::MeterReading reading =
            renderer.meter(scene, {0, 0, 0}, {0, 1, 0}, Renderer::MeterQuality::interactive);
        EXPECT_NEAR(reading.direct_lx() / row.direct, 1.0, 1e-5);
        EXPECT_NEAR(reading.indirect_lx() / row.scattered, 1.0, 0.01)
            << row.extinction << ", g " << row.g << ", at " << row.distance << " m";
    }
}

// Haze that absorbs nothing takes no light out of a closed room, however dense it is and wherever it scatters.
TEST(Haze, AClosedSphereLosesNothing) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    for (const auto& [extinction, g] : {std::pair(0.05, 0.7), {0.5, 0.7}, {0.5, 0.0}, {1.0, -0.5}}) {
        Scene scene = scene_with({{inward_sphere(1.0, 48), glm::vec3(0.0f)}}, isotropic(100.0), {0, 0, 0});
        scene.haze = {.extinction_per_m = extinction, .g = g};
        renew(scene);
        const v1::MeterReading reading =
            renderer.meter(scene, {0, -0.999, 0}, {0, 1, 0}, Renderer::MeterQuality::interactive);
        EXPECT_NEAR(reading.direct_lx() / (100.0 * std::exp(-extinction)), 1.0, 0.005);
        EXPECT_NEAR(reading.total_lx() / 100.0, 1.0, 0.02) << extinction << ", g " << g;
    }
}

// Haze that absorbs nothing leaves a closed room all flux of a luminaire with an opening: the light on its walls is
// Phi / (1 - rho).
TEST(Haze, AnOpeningsFluxStaysInAClosedRoom) {
    constexpr double rho = 0.7;
    const glm::dvec3 a(-5, 0, -4), b(5, 4, 4);
    const auto bulb = *builtin_profile("bulb");
    ASSERT_GT(bulb->photometry.opening.width.base(), 0.0);
    Scene scene = scene_of_pieces(box(a, b, rho, true), {light_seed(bulb, {1, 2.5, 0})});
    scene.haze = {.extinction_per_m = 0.1, .g = 0.7};
    renew(scene);
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    constexpr int kSide = 3;
    double flux_lm = 0.0;
    for (int face = 0; face < 6; ++face) {
        const int axis = face / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
        glm::dvec3 at(0.0), normal(0.0);
        at[axis] = face % 2 == 0 ? a[axis] + 1e-3 : b[axis] - 1e-3;
        normal[axis] = face % 2 == 0 ? 1.0 : -1.0;
        const double area_m2 = (b[u] - a[u]) * (b[v] - a[v]);
        for (int i = 0; i < kSide * kSide; ++i) {
            at[u] = a[u] + (b[u] - a[u]) * (i % kSide + 0.5) / kSide;
            at[v] = a[v] + (b[v] - a[v]) * (i / kSide + 0.5) / kSide;
            flux_lm += area_m2 / (kSide * kSide) *
                       renderer.meter(scene, at, normal, Renderer::MeterQuality::interactive).total_lx();
        }
    }
    EXPECT_NEAR(flux_lm * (1.0 - rho) / bulb->flux_lm, 1.0, 0.03);
}

// A luminaire 1 cm behind the face of a closed slab of 8 cm, in a hazy room: all that it lights stays inside, though
// surfels, points in the air and texels of both sides lie next to each other.
TEST(Haze, StaysInsideAClosedSlab) {
    constexpr double kFront_m = 0.04, kHigh_m = 1.5, kWide_m = 2.0;
    const auto box = [](const glm::dvec3& half) {  // outward
        std::vector<Piece> sides;
        for (int axis = 0; axis < 3; ++axis)
            for (const double side : {-1.0, 1.0}) {
                glm::dvec3 out(0.0), u(0.0), v(0.0);
                out[axis] = side * half[axis];
                u[(axis + 1) % 3] = half[(axis + 1) % 3];
                v[(axis + 2) % 3] = side * half[(axis + 2) % 3];
                sides.push_back({quad(out - u - v, out + u - v, out + u + v, out - u + v), glm::vec3(0.8f)});
            }
        return sides;
    };
    std::vector<Piece> pieces = box({kFront_m, kHigh_m, kWide_m});
    pieces.push_back({inward_sphere(4.0, 32), glm::vec3(0.8f)});
    Scene scene = scene_with(std::move(pieces), isotropic(1000.0), {kFront_m - 0.01, 0, 0});
    scene.haze = {.extinction_per_m = 0.05};
    scene.camera = {{1.0, 0.2, 2.5}, {0.0, 0.0, -0.5}, 1.2};
    renew(scene);
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    const auto picture = renderer.capture(scene, View::luminance, 64, 48, true);
    // The face has 1e7 lx from behind: what comes through is a ten-millionth of the light there.
    double sum_nit = 0.0;
    for (std::size_t i = 0; i < picture->values.size(); i += 4) {
        ASSERT_LT(picture->values[i], 1.0f) << "pixel " << i / 4 % 64 << ", " << i / 4 / 64;
        sum_nit += static_cast<double>(picture->values[i]);
    }
    EXPECT_LT(sum_nit / (64 * 48), 0.05);
}

// The same light as the pixels of a floor show it, which take it from surfels.
TEST(Haze, OntoPixels) {
    Scene scene = floor_scene(0.5, 0.0f, isotropic(100.0), {0, 3, 0});
    scene.haze = {.extinction_per_m = .05, .g = 0.0};
    scene.camera = {{0, 2, 0.01}, {0, 0, 0}, 0.1};
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    const auto picture = renderer.capture(scene, View::illuminance, 17, 17, true);
    EXPECT_NEAR(static_cast<double>(picture->values[4 * (8 * 17 + 8)]) / (9.56342 + 1.863065), 1.0, 0.01);
}

// A cone of 10° of 10,000 cd, crossed at right angles 4 m below the luminaire, 8 m away, by quadrature.
TEST(Haze, ABeamFromTheSide) {
    const auto cone =
        profile_of("cone", 0.05, [](double v, double) { return v <= 10.0 * kPi / 180 + 1e-9 ? 1e4 : 0.0; });
    const struct { double extinction, nit; } rows[] = {{.005, 0.326969}, {.02, 1.09213}, {.05, 1.90404}};
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    for (const auto& row : rows) {
        Scene scene = scene_with(
            {{quad({-0.1, -50, 0.1}, {0.1, -50, 0.1}, {0.1, -50, -0.1}, {-0.1, -50, -0.1}), glm::vec3(0.0f)}}, cone,
            {0, 4, 0});
        scene.haze = {.extinction_per_m = row.extinction, .g = 0.0};
        scene.camera = {{0, 0, 8}, {0, 0, 0}, 0.02};
        EXPECT_NEAR(luminance_ahead(renderer, scene) / row.nit, 1.0, 0.02) << row.extinction;
    }
}

// Airlight grows as 1 / h towards an isotropic luminaire, h the distance between it and a ray: σ I / (4π h) ·
// (π/2 + atan(b/h)), b from the eye to where they are nearest. A pixel shows its mean, that at its middle 4 ln(1 + √2)
// times that of h = its side.
TEST(Haze, NearALuminaire) {
    constexpr int kSide = 128;
    constexpr double kSigma = 1e-5, kAway = 8.0, kHeight = 0.1;
    Scene scene = floor_scene(0.02, 0.0f, isotropic(100.0), {0, 30, 0});
    scene.haze = {.extinction_per_m = kSigma, .g = 0.0};
    scene.camera = {{0, 30, kAway}, {0, 30, 0}, kHeight};
    scene.width_px = scene.height_px = kSide;
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    // On a pixel's corner; on its middle; on a point of the grid; off both.
    for (const glm::dvec2 off : {glm::dvec2(0, 0), {0.5, 0.5}, {2.5, 2.5}, {0.8, 3.3}}) {
        const double pixel = 2.0 * kAway * std::tan(0.5 * kHeight) / kSide;
        scene.lights[0].position = {off.x * pixel, 30.0 + off.y * pixel, 0.0};
        scene.lights[0].position_rev = scene.lights[0].aim_rev = ++scene.scene_rev;
        show(renderer, scene);
        const std::vector<glm::vec3> shown = renderer.live_beams(scene);
        double worst = 0.0, sum = 0.0, expected = 0.0;
        for (int y = 0; y < kSide; ++y)
            for (int x = 0; x < kSide; ++x) {
                const glm::dvec2 apart = (glm::dvec2(x, y) + 0.5 - 0.5 * kSide - off) * pixel;
                double value = 0.0;  // its mean over a pixel, by 16 × 16 middles
                for (int j = 0; j < 16; ++j)
                    for (int i = 0; i < 16; ++i) {
                        const double h = glm::length(apart + (glm::dvec2(i, j) + 0.5 - 8.0) * (pixel / 16.0));
                        value += kSigma * 100.0 / (4.0 * kPi * h) * (kPi / 2.0 + std::atan(kAway / h)) / 256.0;
                    }
                const double own = static_cast<double>(shown[static_cast<std::size_t>(y * kSide + x)].x);
                const double from_middle = std::max(std::abs(apart.x), std::abs(apart.y)) / pixel;
                if (from_middle > 20.0) continue;
                sum += own, expected += value;
                if (from_middle > 1.0) worst = std::max(worst, std::abs(own / value - 1.0));
            }
        EXPECT_LT(worst, 0.06) << off.x << ", " << off.y;
        EXPECT_NEAR(sum / expected, 1.0, 0.02) << off.x << ", " << off.y;
    }
}

// Behind haze a surface keeps what passes; a wall that emits 100 cd/m² and reflects nothing, in light of its own.
TEST(Haze, BeforeASurface) {
    Scene scene =
        scene_with({{quad({-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}), glm::vec3(0.0f), glm::vec3(100.0f)}},
                   isotropic(1e-6), {0, 5, 5});
    scene.haze = {.extinction_per_m = 0.1, .albedo = 0.0, .g = 0.0};
    scene.camera = {{0, 0, 4}, {0, 0, 0}, 0.1};
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    EXPECT_NEAR(luminance_ahead(renderer, scene) / (100.0 * std::exp(-0.4)), 1.0, 1e-3);
    scene.haze.layer_height_m = 2.0;  // the eye is 9 m above the floor of it
    EXPECT_NEAR(luminance_ahead(renderer, scene) / (100.0 * std::exp(-0.4 * std::exp(-4.5))), 1.0, 1e-3);
}

// Haze that only absorbs takes the share 1 - a of what leaves a sphere's wall on its way to the next place of it.
// Chords of 2R cos(theta) have the mean a = ∫ exp(-tau mu) 2 mu dmu = 2 (1 - (1 + tau) exp(-tau)) / tau², tau = 2 sigma
// R. So E0 of direct light brings E0 a rho / (1 - a rho) after every bounce, in each place.
TEST(Haze, AnAbsorbingSphere) {
    constexpr double kRho = 0.8;
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    const auto passed = [](double tau) { return 2.0 * (1.0 - (1.0 + tau) * std::exp(-tau)) / (tau * tau); };
    for (const double extinction : {0.05, 0.5, 2.0}) {
        Scene scene =
            scene_with({{inward_sphere(1.0, 48), glm::vec3(static_cast<float>(kRho))}}, isotropic(100.0), {0, 0, 0});
        scene.haze = {.extinction_per_m = extinction, .albedo = 0.0};
        renew(scene);
        const v1::MeterReading reading =
            renderer.meter(scene, {0, -0.999, 0}, {0, 1, 0}, Renderer::MeterQuality::interactive);
        const double back = passed(2.0 * extinction) * kRho, direct = 100.0 * std::exp(-extinction);
        EXPECT_NEAR(reading.direct_lx() / direct, 1.0, 0.005);
        EXPECT_NEAR(reading.indirect_lx() / (direct * back / (1.0 - back)), 1.0, 0.02) << extinction;
        scene.camera = {{0, 0, 0}, {0, 0, -1}, 1.0};
        const auto picture = renderer.capture(scene, View::illuminance, 33, 33, true);
        EXPECT_NEAR(static_cast<double>(picture->values[4 * (16 * 33 + 16)]) / (direct / (1.0 - back)), 1.0, 0.02)
            << extinction;
    }
}

// The same where the wall itself emits the luminance L: pi L a arrives straight.
TEST(Haze, AnAbsorbingSphereThatEmits) {
    constexpr double kRho = 0.5, kNit = 100.0, kTau = 1.0;
    Scene scene = scene_with({{inward_sphere(1.0, 24), glm::vec3(static_cast<float>(kRho)), glm::vec3(100.0f)}},
                             isotropic(1e-6), {0, 0, 0});
    scene.haze = {.extinction_per_m = 0.5 * kTau, .albedo = 0.0};
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    const v1::MeterReading reading =
        renderer.meter(scene, {0, -0.99, 0}, {0, 1, 0}, Renderer::MeterQuality::interactive);
    const double passed = 2.0 * (1.0 - (1.0 + kTau) * std::exp(-kTau)) / (kTau * kTau);
    EXPECT_NEAR(reading.direct_lx() / (kPi * kNit * passed), 1.0, 0.02);
    EXPECT_NEAR(reading.indirect_lx() / (kPi * kNit * passed * passed * kRho / (1.0 - passed * kRho)), 1.0, 0.03);
}

// Of a narrow beam the first bounce comes from rays of its own: haze that only absorbs takes as much of them as of any
// light, on the way of 2 m to the floor and from there to the meter.
TEST(Haze, ThinsTheFirstBounceOfANarrowBeam) {
    Scene scene = floor_scene(4.0, 0.5f, cosine_power(1000.0, 500.0), {0, 2, 0});
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    const auto bounced = [&] {
        return renderer.meter(scene, {0.8, 1, 0}, {0, -1, 0}, Renderer::MeterQuality::interactive, 1).indirect_lx();
    };
    const double clear = bounced();
    scene.haze = {.extinction_per_m = 0.1, .albedo = 0.0};
    scene.haze_rev = ++scene.scene_rev;
    const double flux_lm = 2.0 * kPi * 1000.0 / 501.0, d2 = 0.8 * 0.8 + 1.0;
    EXPECT_NEAR(clear, 0.5 * flux_lm / kPi / (d2 * d2), 0.03 * clear);  // its spot as a point of the floor
    EXPECT_NEAR(bounced() / clear, std::exp(-0.1 * (2.0 + std::sqrt(d2))), 0.005);
}

// Within walls of one luminance everything has it, the haze too.
TEST(Haze, AFurnace) {
    Scene scene =
        scene_with({{inward_sphere(1.0, 24), glm::vec3(0.5f), glm::vec3(100.0f)}}, isotropic(1e-6), {0, 0, 0});
    scene.haze = {.extinction_per_m = 0.8, .g = 0.5};
    scene.camera = {{0, 0, 0}, {0, 0, -1}, 1.0};
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    EXPECT_NEAR(luminance_ahead(renderer, scene) / 200.0, 1.0, 0.02);
    const auto picture = renderer.capture(scene, View::luminance, 33, 33, true);
    ASSERT_EQ(picture->haze.size(), 3u * 33 * 33);
    EXPECT_NEAR(static_cast<double>(picture->haze[3 * (16 * 33 + 16)]) / (200.0 * (1.0 - std::exp(-0.8))), 1.0, 0.02);
}

// What haze shows to the eye in a built-in room, beside the reference, where it is bright: above a tenth of its mean,
// and not about the luminaire.
struct Compared {
    double rmse, bias;  // of its mean there; what of the rmse is the reference's own is taken off
};
Compared beside_reference(const Scene& scene, int bounces_shown, int bounces_traced) {
    constexpr int kSide = 16;
    Renderer renderer(context(), direct_light());
    const auto shown = renderer.capture(scene, View::luminance, kSide, kSide, true, bounces_shown);
    std::vector<float> halves[2];  // half of how they differ is the error of their mean
    for (std::uint32_t half : {0u, 1u}) {
        trace::PictureRequest request;
        request.camera = scene.camera;
        request.width_px = request.height_px = kSide;
        request.antialias = true;
        trace::Settings settings;
        settings.bounces = bounces_traced;
        settings.max_passes = 128;
        settings.noise = 1e-4;
        settings.seed = half + 1;
        trace::Picture reference(trace::make_world(scene), request, settings);
        while (!reference.refine(60.0).complete) {
        }
        halves[half] = reference.haze();
    }
    const auto luminance_at = [](const std::vector<float>& haze, std::size_t i) {
        return trace::luminance(glm::dvec3(haze[3 * i], haze[3 * i + 1], haze[3 * i + 2]));
    };
    double mean = 0.0, squares = 0.0, sum = 0.0, bias = 0.0, bright = 0.0;
    const auto traced = [&](std::size_t i) { return 0.5 * (luminance_at(halves[0], i) + luminance_at(halves[1], i)); };
    for (std::size_t i = 0; i < kSide * kSide; ++i) mean += traced(i) / (kSide * kSide);
    for (std::size_t i = 0; i < kSide * kSide; ++i) {
        const double a = luminance_at(shown->haze, i), b = traced(i);
        if (b < 0.1 * mean || b > 8.0 * mean) continue;  // dim; or about the luminaire (NearALuminaire)
        const double unsure = 0.5 * (luminance_at(halves[0], i) - luminance_at(halves[1], i));
        bright += 1.0, sum += b, bias += a - b, squares += (a - b) * (a - b) - unsure * unsure;
    }
    return {std::sqrt(std::max(squares, 0.0) / bright) / (sum / bright), bias / sum};
}

TEST(Haze, IsTheReferences) {
    Scene scene = scene_of(builtin("cornell"));
    for (Light& light : scene.lights) light.opening = ies::Opening();
    scene.haze = {.extinction_per_m = 0.01};
    const Compared beams = beside_reference(scene, 0, 1),
                   all = beside_reference(scene, trace::kAllBounces, trace::kAllBounces);
    std::printf("beams: rmse %.4f, bias %.4f; with the glow and every order: rmse %.4f, bias %.4f\n", beams.rmse,
                beams.bias, all.rmse, all.bias);
    EXPECT_LT(beams.rmse, 0.05);
    EXPECT_LT(std::abs(beams.bias), 0.03);
    // The glow comes from 64 links of 4,096 points, and light that is scattered twice is the reference's alone. Single
    // pixels of it are noisy: their mean is compared.
    EXPECT_LT(std::abs(all.bias), 0.1);
}

// What the live light leaves out in fog is within the error that a meter states: light that the air scatters twice, and
// what it absorbs between two surfaces beside the mean. Under the open sky half of the light has been scattered more
// than once.
TEST(Haze, StatesWhatItLeavesOut) {
    const auto isotropic_100 = light_seed(isotropic(100.0), {0.5, 1.8, 0.4});
    std::vector<Placed> yard = {{quad({-3, 0, 3}, {3, 0, 3}, {3, 0, -3}, {-3, 0, -3})},
                                {quad({-3, 0, -3}, {3, 0, -3}, {3, 3, -3}, {-3, 3, -3})}};
    for (Placed& piece : yard) piece.material = matte(0.6);
    const struct {
        const char* name;
        Scene scene;
    } cases[] = {{"room", scene_of_pieces(box({-2, 0, -2}, {2, 3, 2}, 0.6, true), {isotropic_100})},
                 {"yard", scene_of_pieces(std::move(yard), {isotropic_100})}};
    for (const auto& c : cases) {
        for (const double albedo : {1.0, 0.5}) {
            Scene scene = c.scene;
            scene.haze = {.extinction_per_m = 0.15, .albedo = albedo, .g = 0.0};
            renew(scene);
            const std::vector<trace::MeterPoint> points = {{{-1.2, 0.0, 0.9}, {0, 1, 0}, trace::Receives::plane},
                                                           {{0.3, 0.0, -1.5}, {0, 1, 0}, trace::Receives::plane}};
            trace::Settings settings;
            settings.noise = 0.01;
            const auto truth = trace::measure(*trace::make_world(scene), points, settings);
            Renderer renderer(context(), direct_light());
            make_coarse(renderer);
            for (std::size_t i = 0; i < points.size(); ++i) {
                const auto live =
                    renderer.meter(scene, points[i].position, points[i].normal, Renderer::MeterQuality::interactive);
                const double expected = trace::luminance(truth[i].indirect_lx), stated = live.indirect_error_lx();
                EXPECT_NEAR(live.indirect_lx(), expected, 3.0 * (stated + truth[i].indirect_error_lx))
                    << c.name << ", albedo " << albedo << ", point " << i << ", stated " << stated;
                if (&c == cases) {
                    EXPECT_LT(stated, 0.1 * live.indirect_lx());
                }
            }
        }
    }
}

// The cost table of docs/rendering.md.
class HazeCost : public testing::Test {
protected:
    using Ran = std::set<std::string>;
    HazeCost() : renderer(context(), direct_light()), scene(scene_of(builtin("cornell"))) {
        scene.width_px = scene.height_px = 96;
        make_coarse(renderer);
        repeat_light(scene, 2, [](Light& light, std::size_t i) {
            light.opening = ies::Opening();
            if (i == 1) light.position.x += 0.5;
        });
        scene.haze = {.extinction_per_m = 0.02};
    }
    void change(const std::function<void(v1::Command&)>& fill) {
        v1::Command command;
        fill(command);
        const auto applied = apply(scene, command, {});
        ASSERT_TRUE(applied) << applied.error().text();
    }
    // Passes of haze that ran, "name" or "name:light"; and "composite".
    Ran frame() {
        renderer.begin_frame(scene, monotonic_ns());
        const auto done = renderer.finish_frame(true);
        Ran ran;
        states.clear();
        for (const v1::PassReport& row : done->report.passes()) {
            const std::string name = row.name() + (row.has_light() ? ":" + row.light() : "");
            states[row.name()] = row.state();
            if (row.state() == "ran") ran.insert(name);
        }
        settled = done->report.settled();
        return ran;
    }
    void settle() {
        do frame();
        while (!settled);
    }
    Ran haze_of(const Ran& ran) const {
        Ran some;
        for (const std::string& name : ran)
            if (name.find("haze-") != std::string::npos) some.insert(name);
        return some;
    }
    Renderer renderer;
    Scene scene;
    std::map<std::string, std::string> states;
    bool settled = false;
};

TEST_F(HazeCost, WithoutHazeItIsAbsent) {
    scene.haze = {};
    settle();
    for (const char* name : {"haze-points", "haze-distances", "haze-surfels", "haze-rays", "haze-probes", "haze-seen",
                             "haze-airlight", "haze-glow"})
        EXPECT_EQ(states[name], "absent") << name;
}

TEST_F(HazeCost, RunsWhatMoved) {
    settle();
    EXPECT_EQ(frame(), Ran());
    EXPECT_EQ(states["haze-airlight"], "clean");
    const std::string own = scene.lights[1].name;
    change([&](v1::Command& command) {
        command.mutable_set_light()->set_name(own);
        command.mutable_set_light()->set_level_ratio(0.5);
    });
    Ran ran = frame();
    ran.erase("nv12");
    EXPECT_EQ(ran, Ran{"composite"}) << "a level weighs beams anew";
    settle();
    change([&](v1::Command& command) {
        command.mutable_set_light()->set_name(own);
        command.mutable_set_light()->set_tilt_rad(0.3);
    });
    ran = haze_of(frame());
    EXPECT_EQ(ran, (Ran{"haze-distances:" + own, "haze-surfels:" + own, "haze-airlight:" + own, "haze-glow:" + own}));
    settle();
    change([&](v1::Command& command) {
        for (const double x : {0.1, 1.9, 5.0}) command.mutable_set_camera()->add_eye_m(x);
    });
    ran = haze_of(frame());
    EXPECT_TRUE(ran.contains("haze-rays"));
    for (const std::string& name : ran) {
        EXPECT_EQ(name.find("haze-distances"), std::string::npos);
        EXPECT_EQ(name.find("haze-surfels"), std::string::npos);
    }
    settle();
    change([&](v1::Command& command) { command.mutable_set_view()->set_view("illuminance"); });
    frame();
    EXPECT_EQ(states["haze-airlight"], "culled") << "it shows surfaces alone";
}

}  // namespace
}  // namespace gonio::test
