// Calculation grids and observers in the scene: where points lie, what is kept of a grid, what is refused, undo, and
// the saved show.
#include <gtest/gtest.h>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/grid.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/scene/calculation_grid.h"
#include "server/scene/scene.h"
#include "server/scene/target_table.h"
#include "tests/unit/server/undo_fixture.h"

namespace gonio {
namespace {

using namespace undo_test;

// EN 12464-1's rule, by its own readings: the 2011 edition rounds up, the current one to the nearest.
TEST(GridSpacing, TheStandardsNumbersOfPoints) {
    const struct {
        double d_m, p_m, nearest, up;
    } rows[] = {{0.4, 0.1054, 4, 4}, {1, 0.2, 5, 5},       {2, 0.3247, 6, 7},    {5, 0.6160, 8, 9},
                {10, 1, 10, 10},     {25, 1.8974, 13, 14}, {50, 3.0801, 16, 17}, {100, 5, 20, 20}};
    for (const auto& row : rows) {
        EXPECT_NEAR(grid_spacing_m(row.d_m), row.p_m, 5e-5) << row.d_m;
        for (const auto& [rounding, points] :
             {std::pair(GridRounding::nearest, row.nearest), {GridRounding::up, row.up}}) {
            const GridCounts counts = grid_counts(row.d_m, row.d_m, rounding);
            EXPECT_EQ(counts.u, points) << row.d_m;
            EXPECT_EQ(counts.v, points) << row.d_m;
        }
    }
    EXPECT_EQ(grid_spacing_m(1e5), 10) << "at most 10 m";
}

TEST(GridSpacing, ARectangleOfFiveByFour) {
    EXPECT_EQ(grid_counts(5, 4, GridRounding::nearest).u, 8);
    EXPECT_EQ(grid_counts(5, 4, GridRounding::nearest).v, 6);
    EXPECT_EQ(grid_counts(4, 5, GridRounding::nearest).u, 6) << "the longer side may be either";
    EXPECT_EQ(grid_counts(4, 5, GridRounding::nearest).v, 8);
}

// From twice as long on the shorter side decides: 2 m, p = 0.3247 m, and 4 m / 0.3247 m = 12.3.
TEST(GridSpacing, TheShorterSideOfALongRectangleDecides) {
    EXPECT_EQ(grid_counts(4, 2, GridRounding::nearest).u, 12);
    EXPECT_EQ(grid_counts(4, 2, GridRounding::nearest).v, 6);
    EXPECT_EQ(grid_counts(3.99, 2, GridRounding::nearest).v, 4) << "p of 3.99 m is 0.526 m";
}

v1::Grid desk() {
    v1::Grid grid;
    grid.set_name("desk");
    for (const double x : {1.0, 0.8, 2.0}) grid.add_corner_m(x);
    for (const double x : {5.0, 0.0, 0.0}) grid.add_u_m(x);
    for (const double x : {0.0, 0.0, -4.0}) grid.add_v_m(x);
    return grid;
}
v1::Command setting(const v1::Grid& grid) {
    return command_of([&](v1::Command& c) { *c.mutable_set_grid()->mutable_grid() = grid; });
}
v1::Command observing(const std::string& name, double x) {
    return command_of([&](v1::Command& c) {
        v1::Observer& observer = *c.mutable_set_observer()->mutable_observer();
        observer.set_name(name);
        for (const double m : {x, 1.2, 0.0}) observer.add_eye_m(m);
        for (const double m : {0.0, 0.0, -2.0}) observer.add_direction(m);
        observer.mutable_target()->set_name("office-writing");
    });
}
v1::Command without_grid(const std::string& name) {
    return command_of([&](v1::Command& c) { c.mutable_remove_grid()->set_name(name); });
}

TEST(GridLayout, PointsAreTheCentresOfCells) {
    v1::Grid grid = desk();
    const GridLayout whole = grid_layout(grid);
    EXPECT_EQ(whole.counts.u, 8);
    EXPECT_EQ(whole.counts.v, 6);
    EXPECT_NEAR(glm::distance(whole.centre(0, 0), glm::dvec3(1 + 0.3125, 0.8, 2 - 4.0 / 12)), 0, 1e-12);
    EXPECT_NEAR(glm::distance(whole.centre(7, 5), glm::dvec3(6 - 0.3125, 0.8, -2 + 4.0 / 12)), 0, 1e-12);
    grid.set_margin_m(0.5);
    grid.add_count(2);
    grid.add_count(1);
    const GridLayout inner = grid_layout(grid);
    EXPECT_NEAR(glm::distance(inner.centre(0, 0), glm::dvec3(2.5, 0.8, 0)), 0, 1e-12);
    EXPECT_NEAR(glm::distance(inner.centre(1, 0), glm::dvec3(4.5, 0.8, 0)), 0, 1e-12);
}

class Grids : public UndoTest {
protected:
    std::string refused(const v1::Command& command) {
        say(kAnn, command);
        return reply.result().code() + " " + reply.result().field();
    }
    std::string refused(const std::function<void(v1::Grid&)>& change) {
        v1::Grid grid = desk();
        change(grid);
        return refused(setting(grid));
    }
};

TEST_F(Grids, DefaultsAndTheTargetsRowAreFilledIn) {
    v1::Grid grid = desk();
    grid.mutable_target()->set_name("office-writing");
    ASSERT_EQ(say(kAnn, setting(grid)), "ok");
    const v1::State state = full_state(scene());
    ASSERT_EQ(state.grids().grids_size(), 1);
    const v1::Grid& kept = state.grids().grids(0);
    EXPECT_EQ(kept.quantity(), "plane");
    EXPECT_EQ(kept.spacing(), "nearest");
    EXPECT_EQ(kept.maintenance_factor(), 1);
    EXPECT_EQ(kept.target().em_lx(), 500);
    EXPECT_EQ(kept.target().em_modified_lx(), 1000);
    EXPECT_EQ(kept.target().u0_ratio(), 0.6);
    EXPECT_EQ(kept.target().ugr(), 19);
    EXPECT_EQ(kept.target().ez_lx(), 150);
    EXPECT_EQ(kept.target().edition(), "EN 12464-1:2021");
    EXPECT_TRUE(state.has_observers()) << "that there is none is told too";
}

TEST_F(Grids, WhatIsRefusedChangesNothing) {
    for (int i = 0; i < 64; ++i)
        ASSERT_EQ(refused([&](v1::Grid& g) { g.set_name("grid " + std::to_string(i)); }), "ok ");
    for (int i = 0; i < 16; ++i) ASSERT_EQ(refused(observing("eye " + std::to_string(i), 0)), "ok ");
    const std::string before = text();
    EXPECT_EQ(refused([](v1::Grid&) {}), "too_many_grids set_grid.grid.name");
    EXPECT_EQ(refused(observing("one more", 0)), "too_many_observers set_observer.observer.name");
    const struct {
        std::function<void(v1::Grid&)> change;
        const char* answer;
    } rows[] = {
        {[](v1::Grid& g) { g.clear_name(); }, "invalid_argument set_grid.grid.name"},
        {[](v1::Grid& g) { g.clear_corner_m(); }, "invalid_argument set_grid.grid.corner_m"},
        {[](v1::Grid& g) { g.clear_v_m(); }, "invalid_argument set_grid.grid.v_m"},
        {[](v1::Grid& g) { g.set_u_m(0, 0); }, "invalid_argument set_grid.grid.u_m"},
        {[](v1::Grid& g) { g.set_u_m(0, 1001); }, "invalid_argument set_grid.grid.u_m"},
        {[](v1::Grid& g) { g.set_u_m(0, std::nan("")); }, "invalid_argument set_grid.grid.u_m"},
        {[](v1::Grid& g) { g.set_v_m(0, 1); }, "invalid_argument set_grid.grid.v_m"},
        {[](v1::Grid& g) { g.set_quantity("spherical"); }, "invalid_argument set_grid.grid.quantity"},
        {[](v1::Grid& g) { g.set_quantity("vertical"); }, "invalid_argument set_grid.grid.direction"},
        {[](v1::Grid& g) {
             g.set_quantity("semi-cylindrical");
             for (const double x : {0, 1, 0}) g.add_direction(x);
         },
         "invalid_argument set_grid.grid.direction"},
        {[](v1::Grid& g) {
             g.set_quantity("cylindrical");
             for (const double x : {1, 0, 0}) g.add_direction(x);
         },
         "invalid_argument set_grid.grid.direction"},
        {[](v1::Grid& g) { g.set_view("door"); }, "invalid_argument set_grid.grid.view"},
        {[](v1::Grid& g) {
             g.set_quantity("camera");
             g.set_view("door");
         },
         "not_found set_grid.grid.view"},
        {[](v1::Grid& g) { g.set_spacing("odd"); }, "invalid_argument set_grid.grid.spacing"},
        {[](v1::Grid& g) { g.add_count(3); }, "invalid_argument set_grid.grid.count"},
        {[](v1::Grid& g) {
             g.add_count(64);
             g.add_count(65);
         },
         "too_large set_grid.grid.count"},
        {[](v1::Grid& g) { g.set_margin_m(2); }, "invalid_argument set_grid.grid.margin_m"},
        {[](v1::Grid& g) { g.set_margin_m(-0.1); }, "invalid_argument set_grid.grid.margin_m"},
        {[](v1::Grid& g) { g.set_maintenance_factor(0); }, "invalid_argument set_grid.grid.maintenance_factor"},
        {[](v1::Grid& g) { g.set_maintenance_factor(1.1); }, "invalid_argument set_grid.grid.maintenance_factor"},
        {[](v1::Grid& g) { g.mutable_target()->set_name("nothing"); }, "not_found set_grid.grid.target.name"},
        {[](v1::Grid& g) { g.mutable_target()->set_u0_ratio(2); }, "invalid_argument set_grid.grid.target.u0_ratio"},
    };
    for (const auto& row : rows) {
        const auto change = [&](v1::Grid& grid) {
            grid.set_name("grid 1");
            row.change(grid);
        };
        EXPECT_EQ(refused(change), row.answer);
    }
    EXPECT_EQ(refused(without_grid("none")), "not_found remove_grid.name");
    v1::Command up = observing("eye 1", 0);
    up.mutable_set_observer()->mutable_observer()->mutable_direction()->Set(1, 1);
    up.mutable_set_observer()->mutable_observer()->mutable_direction()->Set(2, 0);
    EXPECT_EQ(refused(up), "invalid_argument set_observer.observer.direction");
    EXPECT_EQ(text(), before);
    EXPECT_EQ(refused([](v1::Grid& g) { g.set_name("grid 63"); }), "ok ") << "a name that is taken is written over";
}

TEST_F(Grids, AreUndoneAndRedone) {
    v1::Grid other = desk();
    other.set_quantity("cylindrical");
    expect_there_and_back({setting(desk()), setting(other), observing("seat", 1), observing("seat", 2),
                           without_grid("desk"),
                           command_of([](v1::Command& c) { c.mutable_remove_observer()->set_name("seat"); })});
}

TEST_F(Grids, StayWithTheirScene) {
    ASSERT_EQ(say(kAnn, setting(desk())), "ok");
    ASSERT_EQ(say(kAnn, observing("seat", 1)), "ok");
    const auto load = [&](std::shared_ptr<const SceneAsset> loaded) {
        const auto own = std::exchange(asset, std::move(loaded));
        const std::string code = say(kAnn, command_of([](v1::Command& c) { c.mutable_load_scene()->set_file("x"); }));
        asset = own;
        return code;
    };
    ASSERT_EQ(load(asset), "ok");
    EXPECT_TRUE(scene().grids.contains("desk")) << "the file was written anew";
    EXPECT_TRUE(scene().observers.contains("seat"));
    auto hall = std::make_shared<SceneAsset>(*asset);
    hall->name = "hall";
    ASSERT_EQ(load(hall), "ok");
    EXPECT_TRUE(scene().grids.empty());
    EXPECT_TRUE(scene().observers.empty());
}

TEST_F(Grids, AreInTheSavedShow) {
    v1::Grid grid = desk();
    grid.set_maintenance_factor(0.8);
    grid.mutable_target()->set_em_lx(320);
    ASSERT_EQ(say(kAnn, setting(grid)), "ok");
    ASSERT_EQ(say(kAnn, observing("seat", 1)), "ok");
    EXPECT_TRUE(full_state(scene()).grids().grids_size() == 1 && show_file(scene()).unsaved());
    const auto read = read_show(write_show(show_of(scene(), texts)));
    ASSERT_TRUE(read) << read.error().text();
    const RestoredShow restored = restore_show(*read, asset, true);
    EXPECT_EQ(restored.warnings, std::vector<std::string>{});
    EXPECT_EQ(restored.scene.grids.at("desk")->SerializeAsString(), scene().grids.at("desk")->SerializeAsString());
    EXPECT_EQ(restored.scene.observers.at("seat")->SerializeAsString(),
              scene().observers.at("seat")->SerializeAsString());
    EXPECT_TRUE(restore_show(*read, asset, false).scene.grids.empty()) << "of another scene";
}

TEST(Targets, RowsHaveNamesOfTheirOwn) {
    std::set<std::string_view> names;
    for (const TargetRow& row : target_table()) {
        EXPECT_TRUE(names.insert(row.name).second) << row.name;
        EXPECT_TRUE(row.em_lx > 0 || row.u0_ratio > 0 || row.ugr > 0 || row.ez_lx > 0) << row.name;
        EXPECT_FALSE(row.edition.empty()) << row.name;
    }
    EXPECT_EQ(find_target("nothing"), nullptr);
}

}  // namespace
}  // namespace gonio
