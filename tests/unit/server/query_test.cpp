// What clients ask of meters and captures: every default, every refusal with code, field and value.
#include "server/session/query.h"

#include <gtest/gtest.h>

#include <functional>

#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/measure.pb.h"
#include "protocol/schema/report.pb.h"
#include "server/scene/scene.h"
#include "server/session/meter_reply.h"
#include "tests/scenes/scenes.h"

namespace gonio {
namespace {

v1::MeterQuery some_meter() {
    v1::MeterQuery query;
    for (const double x : {1.0, 0.0, -2.0}) query.add_point_m(x);
    for (const double x : {0.0, 3.0, 0.0}) query.add_normal(x);
    return query;
}

v1::MeterQuery some_grid(std::uint32_t nu, std::uint32_t nv) {
    v1::MeterQuery query = some_meter();
    for (const double x : {4.0, 0.0, 0.0}) query.add_u_m(x);
    for (const double x : {0.0, 0.0, 6.0}) query.add_v_m(x);
    query.add_count(nu);
    query.add_count(nv);
    return query;
}

TEST(MeterQuery, DefaultsOfEachQuality) {
    v1::MeterQuery query = some_meter();
    auto request = check_meter(query);
    ASSERT_TRUE(request) << request.error().text();
    EXPECT_EQ(request->quality, Quality::interactive);
    ASSERT_EQ(request->points.size(), 1u);
    EXPECT_EQ(request->points[0].normal, glm::dvec3(0, 1, 0));
    EXPECT_FALSE(request->grid);
    query.set_quality("rsm");
    query.set_bounces("1");
    EXPECT_EQ(check_meter(query)->quality, Quality::rsm);
    query.set_quality("reference");
    query.clear_bounces();
    request = check_meter(query);
    EXPECT_EQ(request->settings.bounces, trace::kAllBounces);
    EXPECT_DOUBLE_EQ(request->settings.noise, 0.005);
    query.set_bounces("64");
    query.set_noise_ratio(0.002);
    query.set_openings(true);  // it has no effect
    request = check_meter(query);
    ASSERT_TRUE(request) << request.error().text();
    EXPECT_EQ(request->settings.bounces, 64);
    EXPECT_DOUBLE_EQ(request->settings.noise, 0.002);
    query.set_bounces("0");
    EXPECT_EQ(check_meter(query)->settings.bounces, 0);
    query.set_bounces("all");
    EXPECT_EQ(check_meter(query)->settings.bounces, trace::kAllBounces);
}

// Points are the centres of the cells, i along u fastest.
TEST(MeterQuery, AGridHasItsCellCentres) {
    const auto request = check_meter(some_grid(2, 3));
    ASSERT_TRUE(request) << request.error().text();
    EXPECT_TRUE(request->grid);
    ASSERT_EQ(request->points.size(), 6u);
    EXPECT_EQ(request->points[0].position, glm::dvec3(1 + 1, 0, -2 + 1));
    EXPECT_EQ(request->points[1].position, glm::dvec3(1 + 3, 0, -2 + 1));
    EXPECT_EQ(request->points[5].position, glm::dvec3(1 + 3, 0, -2 + 5));
    EXPECT_EQ(check_meter(some_grid(64, 64))->points.size(), 4096u);
    v1::MeterQuery line = some_grid(5, 1);
    line.clear_v_m();
    for (int k = 0; k < 3; ++k) line.add_v_m(0);
    EXPECT_EQ(check_meter(line)->points[4].position, glm::dvec3(1 + 3.6, 0, -2)) << "a line needs no width";
}

TEST(MeterQuery, EveryRefusalNamesCodeFieldAndValue) {
    struct Case {
        const char* code;
        const char* field;
        const char* value;
        std::function<void(v1::MeterQuery&)> spoil;
    };
    const double nan = std::nan("");
    const Case cases[] = {
        {"invalid_argument", "meter.point_m", "", [](auto& q) { q.clear_point_m(); }},
        {"invalid_argument", "meter.point_m", "1,nan,-2", [&](auto& q) { q.set_point_m(1, nan); }},
        {"invalid_argument", "meter.point_m", "1,0,2000000", [](auto& q) { q.set_point_m(2, 2e6); }},
        {"invalid_argument", "meter.normal", "0,3,0,1", [](auto& q) { q.add_normal(1); }},
        {"invalid_argument", "meter.normal", "0,0,0", [](auto& q) { q.set_normal(1, 0); }},
        {"unsupported", "meter.quality", "baked", [](auto& q) { q.set_quality("baked"); }},
        {"unsupported", "meter.bounces", "2",
         [](auto& q) {
             q.set_quality("interactive");
             q.set_bounces("2");
         }},
        {"unsupported", "meter.bounces", "all",
         [](auto& q) {
             q.set_quality("rsm");
             q.set_bounces("all");
         }},
        {"unsupported", "meter.noise_ratio", "0.01", [](auto& q) { q.set_noise_ratio(0.01); }},
        {"unsupported", "meter.max_seconds", "2", [](auto& q) { q.set_max_seconds(2); }},
        {"invalid_argument", "meter.count", "0,3", [](auto& q) { q = some_grid(0, 3); }},
        {"invalid_argument", "meter.count", "3,0", [](auto& q) { q = some_grid(3, 0); }},
        {"invalid_argument", "meter.count", "3", [](auto& q) { q.add_count(3); }},
        {"too_large", "meter.count", "64,65", [](auto& q) { q = some_grid(64, 65); }},
        {"too_large", "meter.count", "4294967295,4294967295", [](auto& q) { q = some_grid(4294967295u, 4294967295u); }},
        {"invalid_argument", "meter.u_m", "",
         [](auto& q) {
             q = some_grid(2, 2);
             q.clear_u_m();
         }},
        {"invalid_argument", "meter.v_m", "0,0,inf",
         [](auto& q) {
             q = some_grid(2, 2);
             q.set_v_m(2, HUGE_VAL);
         }},
        {"invalid_argument", "meter.v_m", "0,0,0",
         [](auto& q) {
             q = some_grid(2, 2);
             q.set_v_m(2, 0);
         }},
        {"invalid_argument", "meter.count", "",
         [](auto& q) {
             q = some_grid(2, 2);
             q.clear_count();
         }},
    };
    for (const Case& expected : cases) {
        v1::MeterQuery query = some_meter();
        expected.spoil(query);
        const auto request = check_meter(query);
        ASSERT_FALSE(request) << expected.field << " " << expected.value;
        EXPECT_EQ(request.error().code, expected.code) << expected.field << " " << expected.value;
        EXPECT_EQ(request.error().where, expected.field) << expected.value;
        EXPECT_EQ(request.error().value, expected.value) << expected.field;
        EXPECT_FALSE(request.error().message.empty());
    }
}

TEST(ReferenceQuery, BouncesAndNoiseOutsideTheirRange) {
    for (const char* bounces : {"65", "-1", "1.5", "2x", " 2", "+2", "many", "99999999999", "ALL"}) {
        v1::MeterQuery query = some_meter();
        query.set_quality("reference");
        query.set_bounces(bounces);
        const auto request = check_meter(query);
        ASSERT_FALSE(request) << bounces;
        EXPECT_EQ(request.error().code, "invalid_argument");
        EXPECT_EQ(request.error().where, "meter.bounces");
        EXPECT_EQ(request.error().value, bounces);
    }
    for (const double noise : {0.0, 0.0004, 0.51, -0.01, std::nan(""), HUGE_VAL}) {
        v1::CaptureQuery query;
        query.set_quality("reference");
        query.set_noise_ratio(noise);
        const auto request = check_capture(Scene{}, query);
        ASSERT_FALSE(request) << noise;
        EXPECT_EQ(request.error().code, "invalid_argument");
        EXPECT_EQ(request.error().where, "capture.noise_ratio");
        EXPECT_EQ(request.error().value, print_number(noise));
    }
    for (const double noise : {0.0005, 0.5}) {
        v1::CaptureQuery query;
        query.set_quality("reference");
        query.set_noise_ratio(noise);
        EXPECT_TRUE(check_capture(Scene{}, query)) << noise;
    }
}

TEST(CaptureQuery, DefaultsComeFromTheScene) {
    Scene scene;
    scene.view = View::luminance;
    scene.width_px = 640;
    scene.height_px = 480;
    v1::CaptureQuery query;
    auto request = check_capture(scene, query);
    ASSERT_TRUE(request);
    EXPECT_EQ(request->quality, Quality::interactive);
    EXPECT_EQ(request->view, View::luminance);
    EXPECT_EQ(request->format, "png");
    EXPECT_EQ(request->width_px, 640);
    query.set_quality("reference");
    query.set_height_px(20);
    request = check_capture(scene, query);
    ASSERT_TRUE(request);
    EXPECT_EQ(request->height_px, 20);
    EXPECT_DOUBLE_EQ(request->settings.noise, 0.02);
    EXPECT_EQ(request->settings.bounces, trace::kAllBounces);
    EXPECT_EQ(request->settings.max_seconds, 0.0);
    EXPECT_FALSE(request->denoise);
    EXPECT_EQ(request->samples_per_pixel, 16u);
    query.set_view("beauty");
    query.set_denoise(true);
    query.set_max_seconds(60);
    request = check_capture(scene, query);
    ASSERT_TRUE(request) << request.error().text();
    EXPECT_TRUE(request->denoise);
    EXPECT_DOUBLE_EQ(request->settings.noise, 0.15);
    EXPECT_DOUBLE_EQ(request->settings.max_seconds, 60.0);
    query.set_noise_ratio(0.05);
    EXPECT_DOUBLE_EQ(check_capture(scene, query)->settings.noise, 0.05);
}

TEST(CaptureQuery, OnlyBeautyOfTheReferenceIsDenoised) {
    v1::CaptureQuery query;
    query.set_denoise(true);
    EXPECT_EQ(check_capture(Scene{}, query).error().where, "capture.denoise");
    query.set_quality("reference");
    for (const char* view : {"direct", "indirect", "illuminance", "luminance"}) {
        query.set_view(view);
        const auto request = check_capture(Scene{}, query);
        ASSERT_FALSE(request) << view;
        EXPECT_EQ(request.error().code, "unsupported");
        EXPECT_EQ(request.error().where, "capture.denoise");
        EXPECT_EQ(request.error().value, view);
    }
}

TEST(ReferenceQuery, SecondsOutsideTheirRange) {
    for (const double seconds : {0.0, 0.09, 86401.0, -1.0, std::nan(""), HUGE_VAL}) {
        v1::MeterQuery query = some_meter();
        query.set_quality("reference");
        query.set_max_seconds(seconds);
        const auto request = check_meter(query);
        ASSERT_FALSE(request) << seconds;
        EXPECT_EQ(request.error().code, "invalid_argument");
        EXPECT_EQ(request.error().where, "meter.max_seconds");
    }
}

TEST(CaptureQuery, EveryRefusalNamesCodeFieldAndValue) {
    struct Case {
        const char* code;
        const char* field;
        const char* value;
        std::function<void(v1::CaptureQuery&)> spoil;
    };
    const Case cases[] = {
        {"invalid_argument", "capture.view", "pretty", [](auto& q) { q.set_view("pretty"); }},
        {"invalid_argument", "capture.format", "gif", [](auto& q) { q.set_format("gif"); }},
        {"unsupported", "capture.quality", "rsm", [](auto& q) { q.set_quality("rsm"); }},
        {"unsupported", "capture.bounces", "2", [](auto& q) { q.set_bounces("2"); }},
        {"unsupported", "capture.noise_ratio", "0.01", [](auto& q) { q.set_noise_ratio(0.01); }},
        {"unsupported", "capture.max_seconds", "2", [](auto& q) { q.set_max_seconds(2); }},
        {"unsupported", "capture.denoise", "true", [](auto& q) { q.set_denoise(true); }},
        {"invalid_argument", "capture.samples_per_pixel", "0", [](auto& q) { q.set_samples_per_pixel(0); }},
        {"invalid_argument", "capture.samples_per_pixel", "65", [](auto& q) { q.set_samples_per_pixel(65); }},
        {"unsupported", "capture.samples_per_pixel", "4",
         [](auto& q) { q.set_quality("reference"), q.set_samples_per_pixel(4); }},
        {"invalid_argument", "capture.width_px", "5000x600", [](auto& q) { q.set_width_px(5000); }},
        {"unsupported", "capture.legend", "beauty", [](auto& q) { q.set_legend(true); }},
        {"unsupported", "capture.legend", "exr",
         [](auto& q) { q.set_legend(true), q.set_view("luminance"), q.set_format("exr"); }},
        {"unsupported", "capture.legend", "159x600",
         [](auto& q) { q.set_legend(true), q.set_view("illuminance"), q.set_width_px(159); }},
    };
    for (const Case& expected : cases) {
        v1::CaptureQuery query;
        expected.spoil(query);
        Scene scene;
        scene.width_px = 800;
        scene.height_px = 600;
        const auto request = check_capture(scene, query);
        ASSERT_FALSE(request) << expected.field << " " << expected.value;
        EXPECT_EQ(request.error().code, expected.code);
        EXPECT_EQ(request.error().where, expected.field);
        EXPECT_EQ(request.error().value, expected.value);
    }
    for (const char* view : {"mask", "rsm-depth", "rsm-normal", "rsm-flux", "solid"}) {
        v1::CaptureQuery query;
        query.set_quality("reference");
        query.set_view(view);
        const auto request = check_capture(Scene{}, query);
        ASSERT_FALSE(request) << view;
        EXPECT_EQ(request.error().code, "unsupported");
        EXPECT_EQ(request.error().where, "capture.view");
        EXPECT_EQ(request.error().value, view);
    }
    for (const char* view : {"beauty", "direct", "indirect", "illuminance", "luminance"}) {
        v1::CaptureQuery query;
        query.set_quality("reference");
        query.set_view(view);
        EXPECT_TRUE(check_capture(Scene{}, query)) << view;
    }
}

// Reference pictures show the scene as it is.
TEST(CaptureQuery, BothQualitiesShowPartsAndDifferences) {
    Scene scene;
    scene.view_only = "key";
    scene.view_compare = "A";
    scene.presets["A"] = std::make_shared<const Preset>();
    v1::CaptureQuery query;
    query.set_view("illuminance");
    query.set_legend(true);
    EXPECT_TRUE(check_capture(scene, query)->legend);
    query.set_quality("reference");
    EXPECT_TRUE(check_capture(scene, query)->legend);
}

// A reading that would lack a sun is refused, unless that is out.
TEST(MeterQuery, ASunThatAReadingWouldLack) {
    Scene scene;
    scene.lights.resize(2);
    scene.lights[0].name = "key";
    scene.lights[1].name = "sky";
    EXPECT_FALSE(check_sun(scene, Quality::rsm));
    scene.lights[1].sun = true;
    const auto lacking = check_sun(scene, Quality::rsm);
    ASSERT_TRUE(lacking);
    EXPECT_EQ(lacking->code, "unsupported");
    EXPECT_EQ(lacking->where, "meter.quality");
    EXPECT_EQ(lacking->value, "rsm");
    EXPECT_NE(lacking->message.find("'sky' is a sun"), std::string::npos);
    EXPECT_FALSE(check_sun(scene, Quality::interactive));
    EXPECT_FALSE(check_sun(scene, Quality::reference));
    scene.technique = Technique::seed;
    ASSERT_TRUE(check_sun(scene, Quality::interactive));
    EXPECT_EQ(check_sun(scene, Quality::interactive)->value, "seed");
    EXPECT_FALSE(check_sun(scene, Quality::reference));
    scene.lights[1].level_ratio = 0.0;
    EXPECT_FALSE(check_sun(scene, Quality::interactive));
}

TEST(MeterReply, MeanLeastGreatestAndUniformity) {
    std::vector<v1::MeterReading> readings;
    for (const double lx : {300.0, 600.0, 450.0, 250.0}) {
        trace::Reading reading;
        reading.direct_lx = glm::dvec3(lx);
        readings.push_back(meter_reading({lx, 0, 0}, reading));
    }
    const v1::MeterGrid grid = meter_message(readings, true).meter_grid();
    EXPECT_DOUBLE_EQ(grid.mean_lx(), 400.0);
    EXPECT_DOUBLE_EQ(grid.min_lx(), 250.0);
    EXPECT_DOUBLE_EQ(grid.max_lx(), 600.0);
    EXPECT_DOUBLE_EQ(grid.uniformity_ratio(), 0.625);
    EXPECT_DOUBLE_EQ(grid.points(2).point_m(0), 450.0);
    EXPECT_DOUBLE_EQ(meter_message({readings[1]}, false).meter().total_lx(), 600.0);
    const v1::MeterGrid dark = meter_message({meter_reading({}, {})}, true).meter_grid();
    EXPECT_EQ(dark.uniformity_ratio(), 0.0);
    // 0.2126 R + 0.7152 G + 0.0722 B.
    trace::Reading red;
    red.indirect_lx = {100, 0, 0};
    EXPECT_DOUBLE_EQ(meter_reading({}, red).total_lx(), 21.26);
}

}  // namespace
}  // namespace gonio
