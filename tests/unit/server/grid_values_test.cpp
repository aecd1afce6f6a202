// What calculation grids read, what their targets say of it, and the glare of an observer: against closed forms and a
// worked example.
#include "server/session/grid_values.h"

#include <gtest/gtest.h>

#include <numbers>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/grid.pb.h"
#include "protocol/schema/measure.pb.h"
#include "protocol/schema/report.pb.h"
#include "server/scene/scene.h"
#include "server/session/glare.h"
#include "server/session/grid_plan.h"
#include "server/session/lux_report.h"
#include "server/session/meter_queue.h"
#include "server/session/meter_reply.h"
#include "server/session/null_renderer.h"
#include "server/session/traced_meters.h"
#include "server/trace/sources.h"
#include "tests/scenes/scenes.h"

namespace gonio {
namespace {

using Change = std::function<void(v1::Grid&)>;

void put(google::protobuf::RepeatedField<double>& field, const glm::dvec3& vector) {
    field.Clear();
    for (int k = 0; k < 3; ++k) field.Add(vector[k]);
}

void run(Scene& scene, const v1::Command& command) {
    const auto applied = apply(scene, command, {});
    ASSERT_TRUE(applied) << applied.error().text();
}

// A grid around the point, of one cell where `change` says nothing else.
void add_grid(
    Scene& scene, const glm::dvec3& middle, const Change& change = [](v1::Grid&) {}) {
    v1::Command command;
    v1::Grid& grid = *command.mutable_set_grid()->mutable_grid();
    grid.set_name("grid");
    put(*grid.mutable_corner_m(), middle - glm::dvec3(0.5, 0, 0.5));
    put(*grid.mutable_u_m(), {1, 0, 0});
    put(*grid.mutable_v_m(), {0, 0, 1});
    grid.add_count(1);
    grid.add_count(1);
    change(grid);
    run(scene, command);
}

MeterRequest asked(const Scene& scene, const char* bounces = "0", bool plan = false) {
    v1::GridQuery query;
    query.set_name("grid");
    query.set_quality("reference");
    query.set_bounces(bounces);
    query.set_plan(plan);
    auto request = check_grid(scene, query);
    EXPECT_TRUE(request) << request.error().text();
    return request ? *request : MeterRequest();
}

v1::GridValues values_of(const Scene& scene, const char* bounces = "0", bool plan = false) {
    const MeterRequest request = asked(scene, bounces, plan);
    return request.answer(traced_readings(*trace::make_world(scene), request, {}, [](const trace::Progress&) {}))
        .grid_values();
}

// 1000 cd from 60° off the vertical, 3 m away: towards +X, 1.5 m above the point.
const glm::dvec3 kPoint(0.25, 0.75, -0.5);
Scene lit_scene() {
    const glm::dvec3 to = 3.0 * glm::dvec3(std::sqrt(0.75), 0.5, 0);
    return test::floor_scene(20.0, 0.0f, test::isotropic(1000.0), kPoint + to);
}

TEST(GridValues, OneSourceHasItsClosedForms) {
    const auto read = [](const char* quantity, const glm::dvec3* direction = nullptr) {
        Scene scene = lit_scene();
        add_grid(scene, kPoint, [&](v1::Grid& grid) {
            grid.set_quantity(quantity);
            if (direction != nullptr) put(*grid.mutable_direction(), *direction);
        });
        return values_of(scene).values_lx(0);
    };
    EXPECT_NEAR(read("plane"), 55.556, 1e-3) << "faces up, though u x v points down";
    EXPECT_NEAR(read("horizontal"), 55.556, 1e-3);
    EXPECT_NEAR(read("cylindrical"), 30.629, 1e-3);
    const struct {
        double azimuth_deg, semi_cylindrical_lx;
    } rows[] = {{0, 61.259}, {60, 45.944}, {90, 30.629}, {180, 0}};
    for (const auto& row : rows) {
        const double azimuth = row.azimuth_deg * std::numbers::pi / 180.0;
        const glm::dvec3 axis(2.0 * std::cos(azimuth), 5.0, 2.0 * std::sin(azimuth));  // its height does not count
        EXPECT_NEAR(read("semi-cylindrical", &axis), row.semi_cylindrical_lx, 1e-3) << row.azimuth_deg;
    }
    const glm::dvec3 towards(1, 0, 0), away(-1, 0, 0), down(0, -1, 0);
    EXPECT_NEAR(read("vertical", &towards), 1000.0 * std::sqrt(0.75) / 9.0, 1e-3);
    EXPECT_EQ(read("vertical", &away), 0);
    EXPECT_EQ(read("plane", &down), 0) << "the other side of the plane";
}

// Four readings of one source lie between 0.785 and 1.111 of the truth, as the azimuth has it.
TEST(GridValues, FourReadingsAreNotTheIntegral) {
    double least = 1e9, greatest = 0;
    for (int degrees = 0; degrees <= 90; degrees += 5) {
        const double azimuth = degrees * std::numbers::pi / 180.0;
        Scene scene = test::floor_scene(
            20.0, 0.0f, test::isotropic(1000.0),
            kPoint + 3.0 * glm::dvec3(std::sqrt(0.75) * std::cos(azimuth), 0.5, std::sqrt(0.75) * std::sin(azimuth)));
        add_grid(scene, kPoint, [](v1::Grid& grid) { grid.set_quantity("cylindrical-4"); });
        const double ratio = values_of(scene).values_lx(0) / 30.629;
        least = std::min(least, ratio), greatest = std::max(greatest, ratio);
    }
    EXPECT_NEAR(least, 0.785, 1e-3);
    EXPECT_NEAR(greatest, 1.111, 1e-3);
}

TEST(GridValues, ACameraIsFaced) {
    Scene scene = lit_scene();
    v1::Command view;
    view.mutable_save_view()->set_name("at the light");
    put(*view.mutable_save_view()->mutable_eye_m(), scene.lights[0].position);
    put(*view.mutable_save_view()->mutable_target_m(), kPoint);
    run(scene, view);
    add_grid(scene, kPoint, [](v1::Grid& grid) {
        grid.set_quantity("camera");
        grid.set_view("at the light");
    });
    EXPECT_NEAR(values_of(scene).values_lx(0), 1000.0 / 9.0, 1e-3);
    view.Clear();
    view.mutable_remove_view()->set_name("at the light");
    run(scene, view);
    v1::GridQuery query;
    query.set_name("grid");
    EXPECT_EQ(check_grid(scene, query).error().where, "grid.view");
}

// Inside an evenly bright sphere every plane and every cylinder has the same indirect illuminance: ρΦ / (4πR²(1 − ρ)).
TEST(GridValues, IndirectLightOfASphereIsTheSameOnACylinder) {
    Scene scene =
        test::scene_with({{test::inward_sphere(2.0, 24), glm::vec3(0.5f)}}, test::isotropic(100.0), {0, 0, 0});
    add_grid(scene, {0.3, 0.2, 0.1}, [](v1::Grid& grid) { grid.set_quantity("cylindrical"); });
    const double direct_lx = values_of(scene, "0").values_lx(0), all_lx = values_of(scene, "all").values_lx(0);
    const double expected_lx = 0.5 * 400.0 * std::numbers::pi / (4.0 * std::numbers::pi * 4.0 * 0.5);
    EXPECT_NEAR(all_lx - direct_lx, expected_lx, 0.04 * expected_lx) << "of a sphere of triangles";
}

TEST(GridValues, StatisticsAreTheMetersOwn) {
    Scene scene = lit_scene();
    add_grid(scene, kPoint, [](v1::Grid& grid) {
        grid.set_count(0, 4);
        grid.set_count(1, 3);
        grid.set_maintenance_factor(0.8);
    });
    const v1::GridValues values = values_of(scene);
    v1::MeterQuery query;
    put(*query.mutable_point_m(), kPoint - glm::dvec3(0.5, 0, 0.5));
    put(*query.mutable_normal(), {0, 1, 0});
    put(*query.mutable_u_m(), {1, 0, 0});
    put(*query.mutable_v_m(), {0, 0, 1});
    query.add_count(4);
    query.add_count(3);
    query.set_quality("reference");
    query.set_bounces("0");
    const auto request = check_meter(query);
    ASSERT_TRUE(request);
    const v1::MeterGrid meters =
        meter_message(traced_readings(*trace::make_world(scene), *request, {}, [](const trace::Progress&) {}), true)
            .meter_grid();
    ASSERT_EQ(values.values_lx_size(), 12);
    for (int i = 0; i < 12; ++i) {
        EXPECT_EQ(values.values_lx(i), 0.8 * meters.points(i).total_lx());
        for (int k = 0; k < 3; ++k) EXPECT_EQ(values.points_m(3 * i + k), meters.points(i).point_m(k));
    }
    EXPECT_EQ(values.mean_lx(), 0.8 * meters.mean_lx());
    EXPECT_EQ(values.min_lx(), 0.8 * meters.min_lx());
    EXPECT_EQ(values.max_lx(), 0.8 * meters.max_lx());
    EXPECT_EQ(values.uniformity_ratio(), meters.uniformity_ratio());
    EXPECT_DOUBLE_EQ(values.diversity_ratio(), meters.min_lx() / meters.max_lx());
    EXPECT_EQ(values.cell_m(0), 0.25);
    EXPECT_EQ(values.quality(), "reference");
    EXPECT_EQ(values.bounces(), "0");
    EXPECT_EQ(values.scene_rev(), scene.scene_rev);
}

// Planes have the direct light that is there, as the interactive renderer has.
class DirectMeters : public NullRenderer {
public:
    explicit DirectMeters(int& read) : read_(read) {}
    v1::MeterReading meter(const Scene& scene, const glm::dvec3& point, const glm::dvec3& normal, MeterQuality,
                           int) override {
        ++read_;
        const auto world = trace::make_world(scene);
        trace::Settings settings;
        settings.bounces = 0;
        const trace::MeterPoint plane{point, normal};
        return meter_reading(point, trace::measure(*world, {&plane, 1}, settings).front(), 0);
    }

private:
    int& read_;
};

TEST(GridValues, InteractiveCylindersHaveTheClosedFormToo) {
    for (const auto& [quantity, expected_lx] : {std::pair("cylindrical", 30.629), {"semi-cylindrical", 45.944}}) {
        Scene scene = lit_scene();
        add_grid(scene, kPoint, [&](v1::Grid& grid) {
            grid.set_quantity(quantity);
            if (grid.quantity() == "semi-cylindrical") put(*grid.mutable_direction(), {0.5, 0, std::sqrt(0.75)});
        });
        MeterRequest request = asked(scene);
        request.quality = Quality::interactive;
        std::vector<v1::ServerMessage> replies;
        Replies out([&](std::uint32_t, v1::ServerMessage message) { replies.push_back(std::move(message)); }, scene);
        int read = 0;
        GuardedRenderer renderer(std::make_unique<DirectMeters>(read), [] { return false; });
        MeterQueue queue;
        Work work;
        work.message.set_request_id(1);
        queue.add(work, scene, std::move(request), out);
        for (int turns = 0; !queue.empty() && turns < 100; ++turns) queue.advance(scene, renderer, out);
        ASSERT_EQ(replies.size(), 1u);
        EXPECT_NEAR(replies[0].grid_values().values_lx(0), expected_lx, 2e-3) << quantity;
        EXPECT_EQ(read, 12);
    }
}

TEST(GridValues, TargetsPassAndFail) {
    v1::Target target;
    target.set_em_lx(500);
    target.set_u0_ratio(0.6);
    target.set_ez_lx(150);
    const auto told = [&](const char* quantity, double mean_lx, double u0) {
        std::string text;
        for (const v1::TargetCheck& check : check_target(target, quantity, mean_lx, u0))
            text += check.name() + (check.passed() ? " pass " : " fail ");
        return text;
    };
    EXPECT_EQ(told("plane", 500, 0.6), "Em pass U0 pass ");
    EXPECT_EQ(told("plane", 499.9, 0.59), "Em fail U0 fail ");
    EXPECT_EQ(told("cylindrical", 150, 0.2), "Ez pass ") << "its U0 is that of the task area";
    EXPECT_EQ(told("cylindrical-4", 149, 0.2), "Ez fail ");
    target.clear_em_lx();
    EXPECT_EQ(told("cylindrical", 150, 0.2), "Ez pass U0 fail ");
    EXPECT_EQ(told("plane", 500, 0.6), "");
    target.clear_ez_lx();
    EXPECT_EQ(told("plane", 500, 0.6), "U0 pass ");
}

TEST(GridPlan, StandsToScaleAndIsEscaped) {
    Scene scene = lit_scene();
    scene.lights[0].name = "<key> & \"fill\"";
    add_grid(scene, kPoint, [](v1::Grid& grid) {
        grid.set_name("<b>");
        put(*grid.mutable_corner_m(), kPoint + glm::dvec3(1.9, 0, 0.5));
        put(*grid.mutable_u_m(), {4, 0, 0});
        put(*grid.mutable_v_m(), {0, 0, -2});
        grid.set_count(0, 4);
        grid.set_count(1, 2);
    });
    v1::GridQuery query;
    query.set_name("<b>");
    query.set_quality("reference");
    query.set_bounces("0");
    query.set_plan(true);
    const auto request = check_grid(scene, query);
    ASSERT_TRUE(request);
    const std::string svg =
        request->answer(traced_readings(*trace::make_world(scene), *request, {}, [](const trace::Progress&) {}))
            .grid_values()
            .plan_svg();
    EXPECT_EQ(svg.find("<b>"), std::string::npos);
    EXPECT_EQ(svg.find("<key>"), std::string::npos);
    EXPECT_NE(svg.find("&lt;key&gt; &amp; &quot;fill&quot;"), std::string::npos) << svg;
    EXPECT_NE(svg.find("width='900.0' height='450.0'"), std::string::npos) << "4 m by 2 m";
    EXPECT_NE(svg.find("4.00 m"), std::string::npos);
    EXPECT_EQ(svg.find("<script"), std::string::npos);
}

// The worked example of the unified glare rating: four Lambertian panels of 0.6 m by 0.6 m and 4000 lm, 1.6 m above the
// eye, 1.2 m to either side, 2.4 m and 4.8 m ahead.
Scene four_panels() {
    auto profile = std::make_shared<Profile>(*test::cosine_power(4000.0 / std::numbers::pi, 1.0));
    profile->photometry.opening.shape = ies::OpeningShape::rectangle;
    profile->photometry.opening.width = profile->photometry.opening.length = 0.6 * m;
    Scene scene = test::floor_scene(20.0, 0.5f, profile, {0, 2.8, 0});
    test::repeat_light(scene, 4, [](Light& light, std::size_t i) {
        light.position = {i % 2 == 0 ? -1.2 : 1.2, 2.8, i < 2 ? -2.4 : -4.8};
    });
    v1::Command command;
    v1::Observer& observer = *command.mutable_set_observer()->mutable_observer();
    observer.set_name("seat");
    put(*observer.mutable_eye_m(), {0, 1.2, 0});
    put(*observer.mutable_direction(), {0, 0, -3});
    observer.mutable_target()->set_ugr(19);
    run(scene, command);
    return scene;
}

v1::Ugr rated(const Scene& scene, double background_nit) {
    v1::UgrQuery query;
    query.set_observer("seat");
    const auto request = check_ugr(scene, query);
    EXPECT_TRUE(request) << request.error().text();
    if (!request) return {};
    EXPECT_EQ(request->points.size(), 1u);
    EXPECT_EQ(request->points[0].normal, glm::dvec3(0, 0, -1));
    return request->answer({lux_reading({0, 1.2, 0}, glm::dvec3(1e4), glm::dvec3(background_nit * std::numbers::pi))})
        .ugr();
}

TEST(Glare, FourPanels) {
    const Scene scene = four_panels();
    for (const auto& [background_nit, expected] : {std::pair(20.0, 22.92), {40.0, 20.51}, {60.0, 19.10}})
        EXPECT_NEAR(rated(scene, background_nit).ugr(), expected, 0.01) << background_nit;
    const v1::Ugr ugr = rated(scene, 40);
    ASSERT_EQ(ugr.sources_size(), 4);
    for (int i = 0; i < 4; ++i) {
        const v1::GlareSource& source = ugr.sources(i);
        EXPECT_EQ(source.left_out(), "");
        EXPECT_NEAR(source.luminance_nit(), 3536.78, 1.0);
        EXPECT_NEAR(source.solid_angle_sr(), i < 2 ? 0.018891 : 0.004096, 1e-6);
        EXPECT_NEAR(source.position_index(), i < 2 ? 3.7867 : 1.9983, 1e-4);
        EXPECT_NEAR(source.term(), i < 2 ? 16479.7 : 12831.9, 10.0);
    }
    ASSERT_EQ(ugr.checks_size(), 1);
    EXPECT_FALSE(ugr.checks(0).passed());
    EXPECT_TRUE(rated(scene, 80).checks(0).passed()) << "17.9";
    EXPECT_FALSE(rated(scene, 0).has_ugr()) << "no background";
    EXPECT_FALSE(rated(scene, 0).checks(0).passed());
}

TEST(Glare, WhatDoesNotCountIsLeftOutWithItsReason) {
    Scene scene = four_panels();
    scene.lights[0].position = {-1.2, 2.8, 2.4};
    scene.lights[1].position = {0.6, 0.2, -2.4};
    scene.lights[2].position = {4.0, 2.8, -1.2};
    auto bare = std::make_shared<Profile>(*scene.lights[3].profile);
    bare->photometry.opening = {};
    scene.lights[3].profile = bare;
    const v1::Ugr ugr = rated(scene, 40);
    ASSERT_EQ(ugr.sources_size(), 4);
    EXPECT_EQ(ugr.sources(0).left_out(), "behind the eye");
    EXPECT_EQ(ugr.sources(1).left_out(), "below the line of sight");
    EXPECT_EQ(ugr.sources(2).left_out(), "outside of the field that CIE 117 covers") << "T/R is 3.3";
    EXPECT_EQ(ugr.sources(3).left_out(), "its photometric file has no luminous opening");
    EXPECT_FALSE(ugr.has_ugr());
    EXPECT_TRUE(ugr.checks(0).passed()) << "nothing glares";
    EXPECT_EQ(ugr.warnings_size(), 1);
}

// A board hangs before the near pair.
TEST(Glare, AHiddenLuminaireDoesNotGlare) {
    const Scene open = four_panels();
    Scene scene = test::scene_with(
        {{test::quad({-9, 0, 9}, {9, 0, 9}, {9, 0, -9}, {-9, 0, -9}), glm::vec3(0.5f)},
         {test::quad({-9, 1.9, -1.2}, {9, 1.9, -1.2}, {9, 2.4, -1.2}, {-9, 2.4, -1.2}), glm::vec3(0.5f)}},
        open.lights[0].profile, {0, 2.8, 0});
    scene.lights = open.lights;
    scene.observers = open.observers;
    const v1::Ugr ugr = rated(scene, 40);
    for (int i = 0; i < 4; ++i) EXPECT_EQ(ugr.sources(i).left_out(), i < 2 ? "hidden" : "") << i;
    EXPECT_NEAR(ugr.ugr(), 8.0 * std::log10(0.25 / 40.0 * 2.0 * 12831.9), 0.01);
}

TEST(Glare, RefusalsNameTheField) {
    const Scene scene = four_panels();
    v1::UgrQuery query;
    EXPECT_EQ(check_ugr(scene, query).error().where, "ugr.eye_m");
    query.set_observer("nobody");
    EXPECT_EQ(check_ugr(scene, query).error().code, "not_found");
    query.set_observer("seat");
    query.set_bounces("0");
    EXPECT_EQ(check_ugr(scene, query).error().where, "ugr.bounces");
    query.set_bounces("");
    put(*query.mutable_eye_m(), {0, 1, 0});
    EXPECT_EQ(check_ugr(scene, query).error().where, "ugr.observer");
    query.clear_observer();
    put(*query.mutable_direction(), {0, 1, 0});
    EXPECT_EQ(check_ugr(scene, query).error().where, "ugr.direction");
}

TEST(LuxReport, IsOnePageWithEverythingEscaped) {
    Scene scene = four_panels();
    add_grid(scene, {0, 0.75, -3}, [](v1::Grid& grid) {
        grid.set_name("desk <1>");
        grid.mutable_target()->set_name("office-writing");
        grid.set_maintenance_factor(0.8);
    });
    scene.lights[0].name = "<script>alert(1)</script>";
    v1::LuxReportQuery query;
    query.set_title("Room \"A\" & <B>");
    query.set_noise_ratio(0.5);
    query.set_width_px(160);
    query.set_height_px(160);
    const auto request = check_lux_report(scene, query, "2020-01-02 03:04 UTC");
    ASSERT_TRUE(request) << request.error().text();
    EXPECT_EQ(request->parts(), 4u) << "two pictures, a grid, an observer";
    std::uint32_t told = 0;
    const v1::ServerMessage message = traced_report(trace::make_world(scene), scene, *request, {},
                                                    [&](const trace::Progress& progress) { told = progress.passes; });
    EXPECT_EQ(told, 4u);
    ASSERT_TRUE(message.has_lux_report()) << message.ShortDebugString();
    const std::string& html = message.lux_report().html();
    const auto count = [&](const std::string& word) {
        std::size_t found = 0;
        for (std::size_t at = html.find(word); at != html.npos; at = html.find(word, at + 1)) ++found;
        return found;
    };
    EXPECT_EQ(count("<script"), 0u);
    EXPECT_EQ(count("<B>"), 0u);
    EXPECT_EQ(count("desk <1>"), 0u);
    EXPECT_GE(count("desk &lt;1&gt;"), 2u);
    EXPECT_EQ(count("http://") - count("http://www.w3.org/2000/svg"), 0u) << "nothing comes from elsewhere";
    EXPECT_EQ(count("https://"), 0u);
    EXPECT_EQ(count("src=\"data:image/"), 2u);
    EXPECT_EQ(count("<svg "), 1u);
    for (const char* word : {"Room &quot;A&quot; &amp; &lt;B&gt;", "2020-01-02 03:04 UTC", "UGR ", "EN 12464-1:2021",
                             "SHA-256", "maintenance factor 0.8", "Signature", "pass", "FAIL"})
        EXPECT_GE(count(word), 1u) << word;
    EXPECT_EQ(count("revision " + std::to_string(scene.scene_rev)), 2u);
    std::stop_source stop;
    stop.request_stop();
    EXPECT_EQ(traced_report(trace::make_world(scene), scene, *request, stop.get_token(), [](const trace::Progress&) {})
                  .message_case(),
              v1::ServerMessage::MESSAGE_NOT_SET);
}

TEST(LuxReport, RefusalsNameTheField) {
    const Scene scene = four_panels();
    const auto refused = [&](const std::function<void(v1::LuxReportQuery&)>& change) {
        v1::LuxReportQuery query;
        change(query);
        const auto request = check_lux_report(scene, query, "");
        return request ? "ok" : request.error().code + " " + request.error().where;
    };
    EXPECT_EQ(refused([](v1::LuxReportQuery&) {}), "ok");
    EXPECT_EQ(refused([](v1::LuxReportQuery& q) { q.set_title(std::string(201, 'a')); }),
              "invalid_argument lux_report.title");
    EXPECT_EQ(refused([](v1::LuxReportQuery& q) { q.set_width_px(63); }), "invalid_argument lux_report.width_px");
    EXPECT_EQ(refused([](v1::LuxReportQuery& q) { q.set_noise_ratio(0); }), "invalid_argument lux_report.noise_ratio");
    EXPECT_EQ(refused([](v1::LuxReportQuery& q) { q.set_bounces("many"); }), "invalid_argument lux_report.bounces");
    EXPECT_EQ(refused([](v1::LuxReportQuery& q) { q.set_max_seconds(0); }), "invalid_argument lux_report.max_seconds");
    EXPECT_EQ(refused([](v1::LuxReportQuery& q) { q.set_bounces("0"); }), "invalid_argument lux_report.bounces")
        << "an observer needs a bounce";
}

}  // namespace
}  // namespace gonio
