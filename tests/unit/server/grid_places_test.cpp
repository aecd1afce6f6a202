// Points of a calculation grid that do not count: inside of closed bodies, outside of the room. However faces are
// turned, and whether they have one side or two.
#include <gtest/gtest.h>

#include <filesystem>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/grid.pb.h"
#include "server/assets/assets.h"
#include "server/scene/scene.h"
#include "server/session/grid_plan.h"
#include "server/session/grid_values.h"
#include "server/session/traced_meters.h"
#include "server/trace/hollows.h"
#include "tests/scenes/scenes.h"
#include "tests/shared_data.h"

namespace gonio {
namespace {

using Pieces = std::vector<test::Piece>;
constexpr glm::vec3 kHalfGrey(0.5f);

enum class Fronts : std::uint8_t { in, out };
// Six quads or, without one of them, five. left_out: 0 -x, 1 +x, 2 bottom, 3 top, 4 -z, 5 +z; -1: none.
void add_box(Pieces& pieces, const glm::dvec3& a, const glm::dvec3& b, Fronts fronts, int left_out = -1) {
    const std::array<std::array<glm::dvec3, 4>, 6> sides = {
        {{{{a.x, a.y, b.z}, {a.x, b.y, b.z}, {a.x, b.y, a.z}, {a.x, a.y, a.z}}},
         {{{b.x, a.y, a.z}, {b.x, b.y, a.z}, {b.x, b.y, b.z}, {b.x, a.y, b.z}}},
         {{{a.x, a.y, a.z}, {b.x, a.y, a.z}, {b.x, a.y, b.z}, {a.x, a.y, b.z}}},
         {{{a.x, b.y, b.z}, {b.x, b.y, b.z}, {b.x, b.y, a.z}, {a.x, b.y, a.z}}},
         {{{a.x, a.y, a.z}, {a.x, b.y, a.z}, {b.x, b.y, a.z}, {b.x, a.y, a.z}}},
         {{{b.x, a.y, b.z}, {b.x, b.y, b.z}, {a.x, b.y, b.z}, {a.x, a.y, b.z}}}}};
    for (int i = 0; i < 6; ++i) {
        const auto& [p, q, r, s] = sides[static_cast<std::size_t>(i)];
        if (i == left_out) continue;
        pieces.push_back({fronts == Fronts::out ? test::quad(p, q, r, s) : test::quad(s, r, q, p), kHalfGrey});
    }
}

const glm::dvec3 kRoomLeast(-4, 0, -4), kRoomMost(4, 4, 4);
Pieces room_of(Fronts fronts = Fronts::in, int left_out = -1) {
    Pieces pieces;
    add_box(pieces, kRoomLeast, kRoomMost, fronts, left_out);
    return pieces;
}
Scene lamp_lit(Pieces pieces, const glm::dvec3& lamp = {0, 3, 0}) {
    Scene scene = test::scene_with(std::move(pieces), test::isotropic(900.0), lamp);
    scene.camera.eye = {0, 20, 50};  // outside of all
    return scene;
}

// count x count points over a square of this side about the middle.
v1::GridValues values_of(Scene scene, double height_m, double side_m = 8.0, const char* quantity = "horizontal",
                         unsigned count = 8) {
    v1::Command command;
    v1::Grid& grid = *command.mutable_set_grid()->mutable_grid();
    grid.set_name("grid");
    for (const double x : {-0.5 * side_m, height_m, 0.5 * side_m}) grid.add_corner_m(x);
    for (const double x : {side_m, 0.0, 0.0}) grid.add_u_m(x);
    for (const double x : {0.0, 0.0, -side_m}) grid.add_v_m(x);
    for (int k = 0; k < 2; ++k) grid.add_count(count);
    grid.set_quantity(quantity);
    if (grid.quantity() == "vertical")
        for (const double x : {1.0, 0.0, 0.0}) grid.add_direction(x);
    EXPECT_TRUE(apply(scene, command, {}));
    v1::GridQuery query;
    query.set_name("grid");
    query.set_quality("reference");
    query.set_bounces("0");
    query.set_plan(true);
    const auto request = check_grid(scene, query);
    if (!request) ADD_FAILURE() << request.error().text();
    if (!request) return {};
    return request->answer(traced_readings(*trace::make_world(scene), *request, {}, [](const trace::Progress&) {}))
        .grid_values();
}

// Result: x and z of the points that are left out for this reason.
std::vector<std::pair<double, double>> left_out(const v1::GridValues& values, const char* reason) {
    std::vector<std::pair<double, double>> places;
    for (const v1::LeftOutPoint& point : values.left_out())
        if (point.reason() == reason)
            places.emplace_back(values.points_m(3 * static_cast<int>(point.point())),
                                values.points_m(3 * static_cast<int>(point.point()) + 2));
    std::ranges::sort(places);
    return places;
}
using Places = std::vector<std::pair<double, double>>;
const Places kCupboard = {{1.5, 1.5}, {1.5, 2.5}, {2.5, 1.5}, {2.5, 2.5}};

// E = I h / d³ of a point source, at the darkest point that counts.
double least_lx(double height_m, double away_m) {
    const double h = 3.0 - height_m;
    return 900.0 * h / std::pow(h * h + away_m * away_m, 1.5);
}

// However the faces of room and cupboard are turned: light meets both sides.
TEST(GridPlaces, PointsInAClosedCupboardDoNotCount) {
    for (const Fronts room : {Fronts::in, Fronts::out})
        for (const Fronts cupboard : {Fronts::in, Fronts::out}) {
            Pieces pieces = room_of(room);
            add_box(pieces, {1, 0, 1}, {3, 1.8, 3}, cupboard);
            const v1::GridValues values = values_of(lamp_lit(std::move(pieces)), 2.5e-3);
            EXPECT_EQ(values.values_lx_size(), 64);
            EXPECT_EQ(left_out(values, "inside"), kCupboard);
            EXPECT_EQ(left_out(values, "outside"), Places{});
            EXPECT_EQ(values.values_lx(1 * 8 + 5), 0.0) << "what is read is kept";
            EXPECT_EQ(left_out_text(values), "points left out: 4 inside closed bodies");
        }
}

TEST(GridPlaces, StatisticsAreOfThosePointsThatCount) {
    Pieces pieces = room_of();
    add_box(pieces, {1, 0.01, 1}, {3, 0.9, 3}, Fronts::in);
    const v1::GridValues values = values_of(lamp_lit(std::move(pieces)), 0.8);
    EXPECT_EQ(left_out(values, "inside"), kCupboard);
    double sum = 0.0, least = 1e9;
    for (int i = 0; i < 64; ++i) {
        const double x = values.points_m(3 * i), z = values.points_m(3 * i + 2);
        if (x > 1 && x < 3 && z > 1 && z < 3) continue;
        sum += values.values_lx(i);
        least = std::min(least, values.values_lx(i));
    }
    EXPECT_NEAR(values.mean_lx(), sum / 60.0, 1e-9);
    EXPECT_GT(least, 0.0);
    EXPECT_EQ(values.min_lx(), least);
    EXPECT_NEAR(values.min_lx(), least_lx(0.8, std::hypot(3.5, 3.5)), 1e-3);
    EXPECT_NEAR(values.uniformity_ratio(), least * 60.0 / sum, 1e-9);
    EXPECT_GT(values.diversity_ratio(), 0.0);
    std::size_t dashes = 0;
    for (std::size_t at = values.plan_svg().find("–"); at != std::string::npos;
         at = values.plan_svg().find("–", at + 1))
        ++dashes;
    EXPECT_EQ(dashes, 4u);
}

// What light gets into counts, though it is dark there: a cupboard without its front, a table, a sheet.
TEST(GridPlaces, WhatIsOpenCounts) {
    const std::function<void(Pieces&)> bodies[] = {
        [](Pieces& all) {
            add_box(all, {1, 0, 1}, {3, 0.9, 3}, Fronts::out, 4);
        },
        [](Pieces& all) {
            all.push_back({test::quad({1, 0.9, 3}, {3, 0.9, 3}, {3, 0.9, 1}, {1, 0.9, 1}), kHalfGrey});
        },
        [](Pieces& all) {
            all.push_back({test::quad({1, 0.9, 1}, {3, 0.9, 1}, {3, 0.9, 3}, {1, 0.9, 3}), kHalfGrey});
        },
        [](Pieces&) {},
    };
    for (const auto& add : bodies)
        for (const Fronts fronts : {Fronts::in, Fronts::out}) {
            Pieces pieces = room_of(fronts);
            add(pieces);
            EXPECT_EQ(values_of(lamp_lit(std::move(pieces)), 0.8).left_out_size(), 0);
        }
    Pieces open = room_of(Fronts::in, 3);
    add_box(open, {1, 0, 1}, {3, 0.9, 3}, Fronts::out, 2);
    EXPECT_EQ(left_out(values_of(lamp_lit(std::move(open)), 0.8), "inside"), kCupboard) << "no bottom, and no ceiling";
    EXPECT_EQ(values_of(test::floor_scene(20, 0.5f, test::isotropic(100), {0, 3, 0}), 0.8).left_out_size(), 0);
}

TEST(GridPlaces, PointsBehindTheWallsDoNotCount) {
    for (const Fronts fronts : {Fronts::in, Fronts::out}) {
        const v1::GridValues values = values_of(lamp_lit(room_of(fronts)), 0.8, 10.0, "horizontal", 10);
        EXPECT_EQ(left_out(values, "inside"), Places{});
        EXPECT_EQ(values.left_out_size(), 36) << "the outer ring of 10 x 10";
        EXPECT_EQ(left_out(values, "outside").size(), 36u);
        EXPECT_NEAR(values.min_lx(), least_lx(0.8, std::hypot(3.5, 3.5)), 1e-3);
    }
    Scene sunny = lamp_lit(room_of(Fronts::in, 3));
    Light sun = sunny.lights[0];
    sun.id = sunny.next_light_id++;
    sun.sun = true;
    sunny.lights.push_back(sun);
    EXPECT_EQ(values_of(sunny, 0.8, 10.0).left_out_size(), 0) << "the sun shines on the court and around it";
}

// A room without a luminaire that is looked at from within, or that is as large as one.
TEST(GridPlaces, ADarkRoomIsNoFurniture) {
    for (const Fronts fronts : {Fronts::in, Fronts::out}) {
        Scene dark = lamp_lit(room_of(fronts), {100, 3, 0});
        dark.camera.eye = {1, 1, 1};
        const v1::GridValues values = values_of(dark, 0.8);
        EXPECT_EQ(values.left_out_size(), 0);
        EXPECT_EQ(values.warnings_size(), 0);
        EXPECT_EQ(values.mean_lx(), 0.0);
    }
    EXPECT_EQ(values_of(lamp_lit(room_of(), {100, 3, 0}), 0.8).warnings_size(), 0);
}

TEST(GridPlaces, WhereNoneIsLeftAllCountWithAWarning) {
    Pieces pieces = room_of();
    add_box(pieces, {-3.9, 0, -3.9}, {3.9, 0.9, 3.9}, Fronts::out);
    const v1::GridValues values = values_of(lamp_lit(std::move(pieces)), 0.8, 6.0);
    EXPECT_EQ(values.left_out_size(), 0);
    ASSERT_EQ(values.warnings_size(), 1);
    EXPECT_NE(values.warnings(0).find("all points"), std::string::npos);
    EXPECT_EQ(values.mean_lx(), 0.0);
}

// Of a grid 1 mm above the floor and on it the readings differ by 1 mm of height.
TEST(GridPlaces, AGridOnTheFloorReadsAsTheOneAboveIt) {
    for (const char* quantity : {"plane", "horizontal", "vertical", "cylindrical", "cylindrical-4"}) {
        Pieces pieces = room_of();
        add_box(pieces, {1, 0, 1}, {3, 0.9, 3}, Fronts::out);
        const Scene scene = lamp_lit(std::move(pieces));
        const v1::GridValues on = values_of(scene, 0.0, 8.0, quantity), above = values_of(scene, 1e-3, 8.0, quantity);
        EXPECT_EQ(left_out(on, "inside"), kCupboard) << quantity;
        EXPECT_EQ(left_out(above, "inside"), kCupboard) << quantity;
        EXPECT_GT(on.mean_lx(), 1.0) << quantity;
        EXPECT_NEAR(on.mean_lx(), above.mean_lx(), 2e-3 * above.mean_lx()) << quantity;
        EXPECT_NEAR(on.min_lx(), above.min_lx(), 2e-3 * above.max_lx()) << quantity;
    }
}

// The verdict is of the air, not of how many points there are; of 64 x 64 it takes no longer than they do.
TEST(GridPlaces, OneVerdictForEachHollow) {
    Pieces pieces = room_of();
    for (int i = 0; i < 4; ++i) add_box(pieces, {-3.0 + i * 1.5, 0, -2}, {-2.0 + i * 1.5, 1, 2}, Fronts::out);
    const Scene scene = lamp_lit(std::move(pieces));
    const auto geometry = trace::geometry_of(scene);
    std::vector<glm::vec3> points;
    for (int j = 0; j < 64; ++j)
        for (int i = 0; i < 64; ++i)
            points.push_back(geometry->local({-4.0 + (i + 0.5) / 8.0, 0.5, -4.0 + (j + 0.5) / 8.0}));
    const auto places = trace::places_of(*geometry, trace::landmarks_of(scene, *geometry), points, 64);
    EXPECT_EQ(std::ranges::count(places, trace::Place::inside), 4 * 8 * 32);
    EXPECT_EQ(std::ranges::count(places, trace::Place::open), 64 * 64 - 4 * 8 * 32);
}

// The room of a case: all of it has two sides, and its cupboard of 1 m stands on the floor.
TEST(GridPlaces, FacesOfTwoSidesToo) {
    for (const Fronts cupboard : {Fronts::in, Fronts::out}) {
        Pieces pieces = room_of();
        add_box(pieces, {1.5, 0, 1.5}, {2.5, 1, 2.5}, cupboard);
        Scene scene = lamp_lit(std::move(pieces));
        auto asset = std::make_shared<SceneAsset>(*scene.asset);
        for (Material& material : asset->materials) material.double_sided = true;
        scene.asset = asset;
        const v1::GridValues on = values_of(scene, 0.0, 8.0, "horizontal", 16),
                             above = values_of(scene, 1e-3, 8.0, "horizontal", 16);
        const Places inside = {{1.75, 1.75}, {1.75, 2.25}, {2.25, 1.75}, {2.25, 2.25}};
        for (const v1::GridValues& values : {on, above}) {
            EXPECT_EQ(left_out(values, "inside"), inside);
            EXPECT_EQ(values.left_out_size(), 4);
        }
        EXPECT_NEAR(on.mean_lx(), above.mean_lx(), 2e-3 * above.mean_lx());
        EXPECT_GT(on.max_lx(), 95.0) << "900 / 9 below the lamp";
    }
}

TEST(GridPlaces, TheSharedCaseOfACupboard) {
    const auto path = test::shared_data("cases/29-grid-in-furniture/room.gltf");
    if (!path) GTEST_SKIP() << "no shared cases on this machine";
    const auto asset = load_scene(*path);
    ASSERT_TRUE(asset) << asset.error().text();
    const v1::GridValues on = values_of(scene_of(*asset), 0.0, 8.0, "horizontal", 16),
                         above = values_of(scene_of(*asset), 1e-3, 8.0, "horizontal", 16);
    EXPECT_EQ(left_out(on, "inside"), left_out(above, "inside"));
    EXPECT_EQ(left_out(on, "inside").size(), 4u);
    EXPECT_EQ(on.left_out_size(), 4);
    EXPECT_NEAR(on.mean_lx(), above.mean_lx(), 2e-3 * above.mean_lx());
    EXPECT_GT(on.max_lx(), 95.0) << "900 / 9 below the lamp";
}

}  // namespace
}  // namespace gonio
