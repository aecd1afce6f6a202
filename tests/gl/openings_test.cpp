// Luminaires with a size: their light near by, their shadows, and how they are seen, against closed forms.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "server/scene/eye.h"
#include "server/scene/opening.h"
#include "server/scene/scene.h"
#include "server/trace/reference.h"
#include "tests/gl/test_context.h"
#include "tests/scenes/scenes.h"
#include "tests/scenes/show.h"

namespace gonio::test {
namespace {

using std::numbers::pi;
constexpr int kOpeningSide = 160;

// A luminaire at height h above a black floor, seen at an angle.
Scene lamp(std::shared_ptr<const Profile> profile, const char* opening, double h, std::vector<Piece> more = {}) {
    more.push_back({quad({-9, 0, 9}, {9, 0, 9}, {9, 0, -9}, {-9, 0, -9}), glm::vec3(0.0f)});
    Scene scene = scene_with(std::move(more), std::move(profile), {0, h, 0});
    scene.lights[0].opening = parse_opening(opening).value();
    scene.camera = {{0, 0.8, 1.2}, {0, 0, 0}, 0.7};
    scene.width_px = scene.height_px = kOpeningSide;
    static Revision newest = 1;  // as if one scene had been loaded after the other
    Light& light = scene.lights[0];
    scene.scene_rev = scene.geometry_rev = scene.camera_rev = scene.lights_rev = light.position_rev = light.aim_rev =
        light.profile_rev = light.level_rev = ++newest;
    return scene;
}

// Where the ray of pixel (x, y), counted from the bottom, meets the floor.
glm::dvec3 floor_at(const Scene& scene, int x, int y) {
    const Eye eye = eye_of(scene.camera, kOpeningSide, kOpeningSide);
    const glm::dvec3 ray = ray_through(eye, (x + 0.5) / kOpeningSide * 2 - 1, (y + 0.5) / kOpeningSide * 2 - 1);
    return eye.position - ray * (eye.position.y / ray.y);
}

// Result: what the live picture shows, lux. rests: after all there is to come.
std::vector<float> live_lux(Renderer& renderer, const Scene& scene, bool rests) {
    renderer.set_refinement(rests);
    show(renderer, scene);
    if (rests) do {
            while (renderer.refine(scene, [] { return false; })) show(renderer, scene);
        } while (!renderer.refined(scene));
    std::vector<float> lux;
    for (const glm::vec3& rgb : renderer.live_illuminance(scene, false)) lux.push_back(rgb.r);
    return lux;
}

// A Lambertian a × b of 1 cd/m² facing down from c, around (0, 0), on a point (x, z) of the floor: corners added up.
double parallel_form(double a, double b, double c, double x, double z) {
    const auto corner = [c](double p, double q) {
        const double u = p / c, v = q / c, ru = std::sqrt(1 + u * u), rv = std::sqrt(1 + v * v);
        return 0.5 * (u / ru * std::atan(v / ru) + v / rv * std::atan(u / rv));
    };
    const double left = -a / 2 - x, right = a / 2 - x, low = -b / 2 - z, high = b / 2 - z;
    return corner(right, high) - corner(left, high) - corner(right, low) + corner(left, low);
}
double disc_form(double r, double d, double x) {
    const double sum = d * d + x * x + r * r;
    return pi / 2 * (1 - (d * d + x * x - r * r) / std::sqrt(sum * sum - 4 * r * r * x * x));
}

struct Form {
    const char* opening;
    double h, area;
    std::function<double(double x, double z)> nit_lx;  // lux per cd/m²
};
const Form kForms[] = {
    {"rect 0.6x0.6", 0.5, 0.36, [](double x, double z) { return parallel_form(0.6, 0.6, 0.5, x, z); }},
    {"rect 1.2x0.3", 1.2, 0.36, [](double x, double z) { return parallel_form(1.2, 0.3, 1.2, x, z); }},
    {"rect 1.5x0.05", 0.75, 0.075, [](double x, double z) { return parallel_form(1.5, 0.05, 0.75, x, z); }},
    {"disc 1", 1.0, pi / 4, [](double x, double z) { return disc_form(0.5, 1.0, std::hypot(x, z)); }},
};

TEST(Openings, LightNearByAsTheirClosedFormsSay) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    for (const Form& form : kForms) {
        const Scene scene = lamp(cosine_power(1000.0, 1.0), form.opening, form.h);
        for (const bool rests : {false, true}) {
            const std::vector<float> lux = live_lux(renderer, scene, rests);
            double most = 0.0;
            for (int y = 4; y < kOpeningSide; y += 13)
                for (int x = 4; x < kOpeningSide; x += 13) {
                    const glm::dvec3 p = floor_at(scene, x, y);
                    const double expected = 1000.0 / form.area * form.nit_lx(p.x, p.z);
                    most = std::max(most, std::abs(static_cast<double>(lux[y * kOpeningSide + x]) / expected - 1));
                }
            EXPECT_LT(most, rests ? 0.005 : 0.02) << form.opening << (rests ? " at rest" : " moving");
        }
        const auto meter = [&](const glm::dvec3& p) {
            return renderer.meter(scene, p, {0, 1, 0}, Renderer::MeterQuality::interactive).direct_lx();
        };
        for (const glm::dvec3 p : {glm::dvec3(0, 0, 0), glm::dvec3(0.7, 0, 0.3), glm::dvec3(-2, 0, 1)}) {
            const double expected = 1000.0 / form.area * form.nit_lx(p.x, p.z);
            EXPECT_NEAR(meter(p), expected, 0.005 * expected) << form.opening << " meter at " << p.x;
        }
    }
    // 1000 lm of 0.6 × 0.6 m on the axis, d / 0.6 m: 5.
    EXPECT_NEAR(renderer
                    .meter(lamp(cosine_power(1000.0 / pi, 1.0), "rect 0.6x0.6", 3.0), {0, 0, 0}, {0, 1, 0},
                           Renderer::MeterQuality::interactive)
                    .direct_lx(),
                34.9027, 0.0175);
}

// Of an edge at distance e before the floor and h below an opening of side s: s e / h. Illuminance there is nearly a
// ramp; its width is 1.25 of what is between a tenth and nine tenths.
double penumbra_m(const Scene& scene, const std::vector<float>& shadowed, const std::vector<float>& open) {
    const int y = kOpeningSide / 2;
    double at[2] = {};
    int found = 0;
    const double levels[2] = {0.9, 0.1};
    double before = 1.0, before_x = floor_at(scene, 0, y).x;
    for (int x = 1; x < kOpeningSide && found < 2; ++x) {
        const std::size_t i = static_cast<std::size_t>(y) * kOpeningSide + static_cast<std::size_t>(x);
        const double share = static_cast<double>(shadowed[i] / open[i]), here = floor_at(scene, x, y).x;
        while (found < 2 && share <= levels[found] && before > levels[found]) {
            at[found] = before_x + (here - before_x) * (before - levels[found]) / (before - share);
            ++found;
        }
        before = share, before_x = here;
    }
    EXPECT_EQ(found, 2);
    return 1.25 * (at[1] - at[0]);
}

// A panel of 1 cd/m² half hidden by a board whose edge is parallel to a side: what is left of it is a smaller panel.
TEST(Openings, MetersInPenumbrasStateTheirError) {
    Renderer renderer(context(), direct_light());
    constexpr double h = 2.0, side = 0.6, edge = 0.01;
    const Scene scene =
        lamp(cosine_power(side * side, 1.0), "rect 0.6x0.6", h,
             {{quad({-3, h / 2, edge}, {-3, h / 2, 4}, {3, h / 2, 4}, {3, h / 2, edge}), glm::vec3(0.0f)}});
    double squares = 0.0, stated = 0.0;
    for (const double z : {-0.22, -0.15, -0.07, 0.0, 0.033, 0.11, 0.18, 0.25}) {
        const double seen = 2.0 * edge - z + side / 2,  // of the panel, from its far side
            expected = parallel_form(side, seen, h, 0.0, z - (seen - side) / 2),
                     whole = parallel_form(side, side, h, 0.0, z);
        const auto reading = renderer.meter(scene, {0, 0, z}, {0, 1, 0}, Renderer::MeterQuality::interactive);
        EXPECT_NEAR(reading.direct_lx(), expected, 3.0 * reading.direct_error_lx()) << z;
        EXPECT_LT(reading.direct_error_lx(), 0.03 * whole);
        squares += std::pow(reading.direct_lx() - expected, 2.0), stated += std::pow(reading.direct_error_lx(), 2.0);
    }
    EXPECT_GT(squares, 0.05 * stated) << "an estimate, not a bound";
    const auto lit = renderer.meter(scene, {0, 0, -2}, {0, 1, 0}, Renderer::MeterQuality::interactive);
    EXPECT_GT(lit.direct_lx(), 0.0);
    EXPECT_EQ(lit.direct_error_lx(), 0.0);
}

TEST(Openings, CastPenumbrasAsWideAsTheirSides) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    constexpr double s = 0.4, e = 1.0, h = 2.0, width = s * e / h;
    const Piece roof{quad({0, e, 9}, {9, e, 9}, {9, e, -9}, {0, e, -9}), glm::vec3(0.0f)};
    const Scene open = lamp(isotropic(1000.0), "rect 0.4x0.4", e + h),
                shadowed = lamp(isotropic(1000.0), "rect 0.4x0.4", e + h, {roof});
    const double moving = penumbra_m(open, live_lux(renderer, shadowed, false), live_lux(renderer, open, false)),
                 resting = penumbra_m(open, live_lux(renderer, shadowed, true), live_lux(renderer, open, true));
    const auto still = [&](const Scene& scene) {
        const auto picture = renderer.capture(scene, View::illuminance, kOpeningSide, kOpeningSide, true, 0, 1);
        std::vector<float> lux(kOpeningSide * kOpeningSide);  // rows from the bottom
        for (int y = 0; y < kOpeningSide; ++y)
            for (int x = 0; x < kOpeningSide; ++x)
                lux[y * kOpeningSide + x] = picture->values[4 * ((kOpeningSide - 1 - y) * kOpeningSide + x)];
        return lux;
    };
    const double captured = penumbra_m(open, still(shadowed), still(open));
    std::printf("penumbra of %.3f m: moving %.4f, at rest %.4f, still %.4f\n", width, moving, resting, captured);
    EXPECT_NEAR(moving, width, 0.1 * width);
    EXPECT_NEAR(resting, width, 0.05 * width);
    EXPECT_NEAR(captured, width, 0.05 * width);
}

// I / projected area, I = 1000 cos² cd of 0.6 × 0.6 m: 2777.8 cd/m² straight on, 250 / 0.18 at 60°, nothing from
// behind.
TEST(Openings, AreSeenWithTheirLuminance) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    Scene scene = floor_scene(8.0, 0.5f, cosine_power(1000.0, 2.0), {0, 1, 0}, orientation_aiming({0, 0, -1}));
    scene.lights[0].opening = parse_opening("rect 0.6x0.6").value();
    const auto middle = [](const std::vector<float>& values) { return values[4 * (32 * 65 + 32)]; };
    const auto seen_from = [&](const glm::dvec3& eye) {
        scene.camera = {eye, {0, 1, 0}, 0.5};
        return middle(renderer.capture(scene, View::luminance, 65, 65, true)->values);
    };
    const auto traced_from = [&](const glm::dvec3& eye) {
        trace::Settings settings;
        settings.max_passes = 8;
        trace::Picture picture(trace::make_world(scene), {{eye, {0, 1, 0}, 0.5}, 65, 65}, settings);
        while (!picture.refine(1.0).complete) {
        }
        return middle(picture.values());
    };
    struct View60 {
        glm::dvec3 eye;
        double nit;
    };
    for (const auto& [eye, nit] : {View60{{0, 1, -3}, 1000 / 0.36}, {{3 * std::sin(pi / 3), 1, -1.5}, 250 / 0.18}}) {
        EXPECT_NEAR(seen_from(eye), nit, 0.005 * nit);
        EXPECT_NEAR(traced_from(eye), nit, 0.005 * nit) << "reference";
    }
    EXPECT_EQ(seen_from({0, 1, 3}), 0.0f) << "from behind, before nothing";
    EXPECT_EQ(traced_from({0, 1, 3}), 0.0f);
    // What is seen is not light that comes once more: E of the reference is the closed form, of a Lambertian one.
    Scene lit = lamp(cosine_power(1000.0, 1.0), "rect 0.6x0.6", 0.6);
    const trace::MeterPoint at[] = {{{0, 0, 0}, {0, 1, 0}}};
    trace::Settings settings;
    settings.noise = 0.002;
    const double expected = 1000.0 / 0.36 * parallel_form(0.6, 0.6, 0.6, 0, 0);
    EXPECT_NEAR(trace::measure(*trace::make_world(lit), at, settings).front().direct_lx.y, expected, 0.006 * expected);
}

// Y' of the live picture, rows from the top: an opening is white in it, whether shaders or the CPU compose it.
TEST(Openings, AreSeenLive) {
    const Piece ceiling{quad({-2, 2, -2}, {2, 2, -2}, {2, 2, 2}, {-2, 2, 2}), glm::vec3(0.5f)};
    Scene scene = lamp(cosine_power(1000.0, 1.0), "rect 0.6x0.6", 1.9, {ceiling});
    scene.camera = {{0, 0.5, 1.5}, {0, 1.9, 0}, 0.9};
    scene.exposure_ev100 = 8.0;
    std::vector<std::uint8_t> pictures[2];
    for (const int gl : {0, 1}) {
        Renderer renderer(context(), gl != 0 ? Renderer::DirectLight::gl : Renderer::DirectLight::rays);
        make_coarse(renderer);
        do {
            renderer.begin_frame(scene, monotonic_ns());
            if (const auto nv12 = renderer.finish_frame(true)->nv12) pictures[gl] = *nv12;
        } while (!renderer.settled());
        EXPECT_GE(pictures[gl][kOpeningSide / 2 * kOpeningSide + kOpeningSide / 2], 230) << gl;
        EXPECT_LE(pictures[gl][kOpeningSide / 2 * kOpeningSide + 2], 200) << gl;
    }
    int differ = 0;
    for (std::size_t i = 0; i < std::size_t{kOpeningSide} * kOpeningSide; ++i)
        differ += std::abs(pictures[0][i] - pictures[1][i]) > 6;
    EXPECT_LT(differ, kOpeningSide * kOpeningSide / 50);
}

// One that is mounted on a ceiling, let into it by a millimetre, or stands before it by one.
TEST(Openings, AreSeenAndShineWhereTheyAreMounted) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    const Piece ceiling{quad({-2, 2, -2}, {2, 2, -2}, {2, 2, 2}, {-2, 2, 2}), glm::vec3(0.0f)};
    for (const double h : {2.0, 1.9991, 2.0009}) {
        Scene scene = lamp(cosine_power(1000.0, 1.0), "rect 0.6x0.6", h, {ceiling});
        const double expected = 1000.0 / 0.36 * parallel_form(0.6, 0.6, h, 0, 0);
        EXPECT_NEAR(renderer.meter(scene, {0, 0, 0}, {0, 1, 0}, Renderer::MeterQuality::interactive).direct_lx(),
                    expected, 0.005 * expected)
            << h;
        const std::vector<float> lux = live_lux(renderer, scene, false);
        const glm::dvec3 p = floor_at(scene, 80, 80);
        const double there = 1000.0 / 0.36 * parallel_form(0.6, 0.6, h, p.x, p.z);
        EXPECT_NEAR(lux[80 * kOpeningSide + 80], there, 0.02 * there) << h;
        scene.camera = {{0, 0.5, 1.5}, {0, 2, 0}, 0.5};
        EXPECT_NEAR(renderer.capture(scene, View::luminance, 65, 65, true)->values[4 * (32 * 65 + 32)], 1000 / 0.36,
                    20.0)
            << h;
    }
    // What stands before one hides it.
    const Piece board{quad({-1, 1, -1}, {1, 1, -1}, {1, 1, 1}, {-1, 1, 1}), glm::vec3(0.0f)};
    Scene scene = lamp(cosine_power(1000.0, 1.0), "rect 0.6x0.6", 2.0, {ceiling, board});
    scene.camera = {{0, 0.5, 0.5}, {0, 2, 0}, 0.5};
    EXPECT_EQ(renderer.capture(scene, View::luminance, 65, 65, true)->values[4 * (32 * 65 + 32)], 0.0f);
}

TEST(Openings, CostWhatTheTableSays) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    Scene scene = scene_of(builtin("cornell"));
    scene.width_px = scene.height_px = 96;
    const auto frame = [&] {
        renderer.begin_frame(scene, monotonic_ns());
        return renderer.finish_frame(true)->report;
    };
    const auto state_of = [](const v1::FrameReport& report) {
        for (const v1::PassReport& row : report.passes())
            if (row.name() == "openings") return row.state();
        return std::string();
    };
    const auto ran = [&] { return passes_run(frame()); };
    EXPECT_EQ(state_of(frame()), "absent") << "of points";
    show(renderer, scene);
    scene.lights[0].opening = parse_opening("rect 0.4x0.4").value();
    scene.lights[0].profile_rev = ++scene.scene_rev;
    EXPECT_EQ(state_of(frame()), "ran");
    show(renderer, scene);
    EXPECT_EQ(ran(), std::set<std::string>{});
    scene.lights[0].level_ratio = 0.5;
    scene.lights[0].level_rev = ++scene.scene_rev;
    std::set<std::string> few = ran();
    few.erase("nv12");
    EXPECT_EQ(few, std::set<std::string>{"composite"});
    scene.camera.eye.x += 0.01;
    scene.camera_rev = ++scene.scene_rev;
    const std::set<std::string> moved = ran();
    EXPECT_TRUE(moved.contains("openings"));
    EXPECT_FALSE(moved.contains("surfels") || moved.contains("solve") || moved.contains("shadow"));
    show(renderer, scene);
    scene.view = View::illuminance;
    scene.view_rev = ++scene.scene_rev;
    EXPECT_NE(state_of(frame()), "ran") << "surfaces only";
}

// Printed, never asserted: what a size costs while it moves and at rest.
TEST(Openings, CostOfTheirLight) {
    Renderer renderer(context(), Renderer::DirectLight::rays);
    make_coarse(renderer);
    Scene scene = scene_of(builtin("cornell"));
    scene.width_px = scene.height_px = 800;
    double ms[2][2] = {};
    for (const bool rests : {false, true}) {
        for (const int size : {0, 1}) {
            scene.lights[0].opening = parse_opening(size == 0 ? "point" : "rect 0.6x0.6").value();
            for (int i = 0; i < (rests ? 2 : 24); ++i) {
                scene.lights[0].position_rev = scene.lights[0].profile_rev = ++scene.scene_rev;
                scene.lights[0].position.x += 0.01;
                renderer.set_refinement(rests);
                renderer.begin_frame(scene, monotonic_ns());
                v1::FrameReport report = renderer.finish_frame(true)->report;
                for (int k = 0; rests && k < 200; ++k) {
                    show(renderer, scene);
                    renderer.refine(scene, [] { return false; });
                    renderer.begin_frame(scene, monotonic_ns());
                    report = renderer.finish_frame(true)->report;
                    if (passes_run(report).contains("direct")) break;
                }
                for (const v1::PassReport& row : report.passes())
                    if (row.name() == "direct") {
                        double& least = ms[rests ? 1 : 0][size];
                        least = i == 0 ? row.cpu_ms() : std::min(least, row.cpu_ms());
                    }
            }
        }
        std::printf("direct light of cornell %s: a point %.2f ms, 0.6 × 0.6 m %.2f ms\n", rests ? "at rest" : "moving",
                    ms[rests ? 1 : 0][0], ms[rests ? 1 : 0][1]);
    }
    EXPECT_GT(ms[0][1], 0.0);
}

}  // namespace
}  // namespace gonio::test
