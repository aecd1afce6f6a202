// The next edition of an MVR show over a scene that was worked on: what the file changed, and what stays.
#include <algorithm>
#include <chrono>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/console.pb.h"
#include "protocol/schema/cue.pb.h"
#include "protocol/schema/grid.pb.h"
#include "server/exchange/import_mvr.h"
#include "server/scene/apply.h"
#include "server/scene/cue.h"
#include "server/scene/imported.h"
#include "server/scene/merge_report.h"
#include "server/scene/scene.h"
#include "tests/shared_data.h"
#include "tests/unit/scene/exchange_test_support.h"
#include "tests/unit/scene/mvr_shows.h"
#include "tests/unit/server/undo_fixture.h"

namespace gonio::undo_test {
namespace {

struct Par {
    std::string name, uuid, at_mm = "0,0,3000";
    std::string address = "1", mode = "Mode 1", more = {}, matrix = "{1,0,0}{0,1,0}{0,0,1}";
};

std::string par_gdtf() {
    const auto mode = [](const std::string& name, const std::string& channels) {
        return "<DMXMode Name=\"" + name + "\" Geometry=\"Lens\"><DMXChannels>" + channels + "</DMXChannels></DMXMode>";
    };
    const std::string dimmer = test::channel_text("Lens", "Dimmer", "1");
    const std::string text =
        test::gdtf_text({.geometries = "<Beam Name='Lens' LuminousFlux='5000' BeamAngle='20' FieldAngle='30'/>",
                         .modes = mode("Mode 1", dimmer) +
                                  mode("Mode 2", dimmer + test::channel_text("Lens", "Zoom", "2", "25", "50"))});
    return *write_zip(std::vector<ZipFile>{{"description.xml", text}});
}

std::string mvr_of(const std::vector<Par>& pars, const std::string& group = "Front wash") {
    std::string fixtures;
    for (const Par& par : pars)
        fixtures += "<Fixture name='" + par.name + "' uuid='" + par.uuid + "'><Matrix>" + par.matrix + "{" + par.at_mm +
                    "}</Matrix><GDTFSpec>Maker@Par</GDTFSpec><GDTFMode>" + par.mode +
                    "</GDTFMode><Addresses><Address break='0'>" + par.address + "</Address></Addresses>" + par.more +
                    "</Fixture>";
    return test::show_mvr("<GroupObject name='" + group + "'><ChildList>" + fixtures + "</ChildList></GroupObject>",
                          {{"Maker@Par.gdtf", par_gdtf()}}, "<Class uuid='c1' name='Warm'/>");
}

std::string id(int number) {
    return "<FixtureID>" + std::to_string(number) + "</FixtureID>";
}

v1::Command merge(bool dry_run = false) {
    v1::Command command = load("show.mvr");
    command.mutable_load_scene()->set_merge(true);
    command.mutable_load_scene()->set_dry_run(dry_run);
    return command;
}

v1::Command place(const std::string& light, double x) {
    return command_of([&](v1::Command& said) {
        said.mutable_set_light()->set_name(light);
        for (const double at : {x, 3.0, 0.0}) said.mutable_set_light()->add_position_m(at);
    });
}

class MergeTest : public UndoTest {
protected:
    void SetUp() override {
        UndoTest::SetUp();
        begin({a, b});
    }
    void begin(const std::vector<Par>& pars) {
        asset = test::imported(mvr_of(pars));
        start();
    }
    void next(const std::vector<Par>& pars, const std::string& group = "Front wash") {
        asset = test::imported(mvr_of(pars, group));
    }
    bool tells(const std::string& words) const {
        const auto lines = warnings();
        return std::ranges::any_of(lines, [&](const std::string& line) { return line.find(words) != line.npos; });
    }
    std::string told() const {
        std::string all;
        for (const std::string& line : warnings()) all += line + "\n";
        return all;
    }
    std::uint32_t address_of(const std::string& light) const {
        if (!scene().patch) return 0;
        for (const v1::PatchRow& row : scene().patch->rows())
            if (row.target() == light && row.property() == "level") return row.address();
        return 0;
    }

    const Par a{"A", "8DA19619-C8F6-58B1-ADEB-2B8F954E3226", "0,0,3000", "1", "Mode 1", id(1)};
    const Par b{"B", "F531086D-E77A-51E9-BA85-2232259646E1", "2000,0,3000", "2", "Mode 1", id(2)};
    const Par c{"C", "57DE7152-1076-5713-8944-2428002F57E5", "-2000,0,3000", "3", "Mode 1", id(3)};
    Par a_moved() const {
        Par par = a;
        par.at_mm = "1000,0,3000";
        return par;
    }
};

TEST_F(MergeTest, TheShowStaysAndTheFileCounts) {
    say(kAnn, level("A 1", 0.5));
    say(kAnn, group("mine", {"A 1", "B 2"}));
    say(kAnn, save("look"));
    say(kAnn, add_cue("1"));
    say(kAnn, command_of([](v1::Command& said) {
            v1::Grid& grid = *said.mutable_set_grid()->mutable_grid();
            grid.set_name("desk");
            for (const double at : {-0.5, 0.1, -0.5}) grid.add_corner_m(at);
            for (const double along : {1.0, 0.0, 0.0}) grid.add_u_m(along);
            for (const double along : {0.0, 0.0, 1.0}) grid.add_v_m(along);
        }));
    const std::uint32_t id_of_a = light("A 1").id;
    const std::string before = text();
    next({a_moved(), c});
    ASSERT_EQ(say(kAnn, merge()), "ok") << reply.ShortDebugString();
    ASSERT_FALSE(warnings().empty());
    EXPECT_EQ(warnings()[0], "merged: added 1, moved 1, mode 0, removed 1, unchanged 0, conflicts 0") << told();
    EXPECT_TRUE(tells("added: \"C 3\"")) << told();
    EXPECT_TRUE(tells("moved: \"A 1\" by 1 m, to 1,3,-0") || tells("moved: \"A 1\" by 1 m, to 1,3,0")) << told();
    EXPECT_TRUE(tells("missing: \"B 2\"")) << told();
    ASSERT_EQ(scene().lights.size(), 3u);
    EXPECT_NEAR(light("A 1").position.x, 1.0, 1e-9);
    EXPECT_EQ(light("A 1").level_ratio, 0.5);
    EXPECT_EQ(light("A 1").id, id_of_a);
    EXPECT_TRUE(light("B 2").missing);
    EXPECT_EQ(own_weight(light("B 2")), glm::dvec3(0.0));
    EXPECT_GT(own_weight(light("C 3")).r, 0.0);
    EXPECT_EQ(address_of("C 3"), 3u);
    EXPECT_EQ(scene().grids.count("desk"), 1u);
    EXPECT_EQ(scene().groups.at("mine"), (std::vector<std::string>{"A 1", "B 2"}));
    EXPECT_EQ(scene().groups.at("Front wash"), (std::vector<std::string>{"A 1", "B 2", "C 3"}));
    ASSERT_EQ(scene().cues->size(), 1u);
    EXPECT_EQ((*scene().cues)[0]->content->size(), 2u) << "the cue still knows what is missing";
    say(kAnn, level("A 1", 0.1));
    ASSERT_EQ(say(kAnn, recall("look")), "ok");
    EXPECT_EQ(light("A 1").level_ratio, 0.5);
    EXPECT_NEAR(light("A 1").position.x, 1.0, 1e-9) << "a preset does not hang it back";
    EXPECT_EQ(own_weight(light("B 2")), glm::dvec3(0.0)) << "nor does it light what is missing";
    undo(kAnn);
    undo(kAnn);
    const std::string merged = text();
    ASSERT_EQ(undo(kAnn), "ok");
    EXPECT_EQ(difference(text(), before), "");
    ASSERT_EQ(redo(kAnn), "ok");
    EXPECT_EQ(difference(text(), merged), "");
}

TEST_F(MergeTest, ADryRunSaysTheSameAndChangesNothing) {
    say(kAnn, level("A 1", 0.5));
    const std::string before = text();
    const Revision rev = scene().scene_rev;
    next({a_moved(), c});
    ASSERT_EQ(say(kAnn, merge(true)), "ok");
    const std::vector<std::string> tried = warnings();
    EXPECT_EQ(tried[0], "would be merged: added 1, moved 1, mode 0, removed 1, unchanged 0, conflicts 0");
    EXPECT_EQ(difference(text(), before), "");
    EXPECT_EQ(scene().scene_rev, rev);
    EXPECT_FALSE(reply.result().has_replaced());
    EXPECT_EQ(labels[kAnn].undo_label(), "level of A 1");
    ASSERT_EQ(say(kAnn, merge()), "ok");
    std::vector<std::string> done = warnings();
    done[0] = tried[0];
    EXPECT_EQ(done, tried);
    EXPECT_EQ(labels[kAnn].undo_label(), "merge show.mvr");
}

TEST_F(MergeTest, TheSameFileChangesNothing) {
    say(kAnn, level("A 1", 0.5));
    const auto position = light("A 1").position;
    next({a, b});
    ASSERT_EQ(say(kAnn, merge()), "ok");
    EXPECT_EQ(warnings()[0], "merged: added 0, moved 0, mode 0, removed 0, unchanged 2, conflicts 0") << told();
    EXPECT_EQ(light("A 1").level_ratio, 0.5);
    EXPECT_EQ(light("A 1").position, position);
    EXPECT_EQ(scene().patch, asset->patch) << "it is the file's own, and goes with it";
}

TEST_F(MergeTest, WhatWasEditedHereStaysUntilTheFileChangesItToo) {
    say(kAnn, place("A 1", 5));
    v1::Command patched = command_of([&](v1::Command& said) { *said.mutable_set_patch() = *scene().patch; });
    for (v1::PatchRow& row : *patched.mutable_set_patch()->mutable_rows())
        if (row.target() == "A 1") row.set_address(100);
    ASSERT_EQ(say(kAnn, patched), "ok");
    next({a, b});
    ASSERT_EQ(say(kAnn, merge()), "ok");
    EXPECT_TRUE(tells("kept: \"A 1\" its place")) << told();
    EXPECT_TRUE(tells("kept: \"A 1\" its patch")) << told();
    EXPECT_EQ(light("A 1").position.x, 5.0);
    EXPECT_EQ(address_of("A 1"), 100u);
    EXPECT_EQ(address_of("B 2"), 2u);
    Par other = a_moved();
    other.address = "1.41";
    next({other, b});
    ASSERT_EQ(say(kAnn, merge()), "ok");
    EXPECT_EQ(warnings()[0], "merged: added 0, moved 1, mode 0, removed 0, unchanged 1, conflicts 2") << told();
    EXPECT_TRUE(tells("patched: \"A 1\" 1.1 -> 1.41")) << told();
    EXPECT_NEAR(light("A 1").position.x, 1.0, 1e-9);
    EXPECT_EQ(address_of("A 1"), 41u);
}

TEST_F(MergeTest, AnAimOfOnesOwnStays) {
    say(kAnn, pan("A 1", 0.4));
    const glm::dquat aimed = light("A 1").world_from_light;
    Par turned_a = a, turned_b = b;  // both hang a quarter round
    turned_a.matrix = turned_b.matrix = "{0,0,-1}{0,1,0}{1,0,0}";
    next({turned_a, turned_b});
    ASSERT_EQ(say(kAnn, merge()), "ok");
    EXPECT_TRUE(tells("kept: \"A 1\" its aim")) << told();
    EXPECT_TRUE(tells("turned: \"B 2\"")) << told();
    EXPECT_NEAR(std::abs(glm::dot(light("A 1").world_from_light, aimed)), 1.0, 1e-12);
    EXPECT_NEAR(std::abs(glm::dot(light("B 2").world_from_light, asset->lights[1].world_from_light)), 1.0, 1e-12);
}

TEST_F(MergeTest, AnotherModeBringsItsWebUnlessSomebodyGaveAnother) {
    ASSERT_EQ(say(kAnn, command_of([](v1::Command& said) { said.mutable_set_light()->set_name("A 1"); }), another),
              "ok")
        << reply.ShortDebugString();
    ASSERT_EQ(reply.result().code(), "ok");
    Par other_a = a, other_b = b;
    other_a.mode = other_b.mode = "Mode 2";
    next({other_a, other_b});
    ASSERT_EQ(say(kAnn, merge()), "ok");
    EXPECT_TRUE(tells("mode 2,")) << told();
    EXPECT_TRUE(tells("mode: \"B 2\" Maker@Par, Mode 1 -> Maker@Par, Mode 2")) << told();
    EXPECT_TRUE(tells("kept: \"A 1\" its own profile")) << told();
    EXPECT_EQ(light("A 1").profile->name, "another");
    EXPECT_EQ(light("B 2").profile, asset->lights[1].profile);
}

TEST_F(MergeTest, AProfileOfOnesOwnStaysAfterAnotherRoom) {
    ASSERT_EQ(say(kAnn, command_of([](v1::Command& said) { said.mutable_set_light()->set_name("A 1"); }), another),
              "ok")
        << reply.ShortDebugString();
    const auto mvr = asset;
    asset = *load_scene("cornell");
    v1::Command room = load("cornell");
    room.mutable_load_scene()->add_keep("lights");
    ASSERT_EQ(say(kAnn, room), "ok");
    asset = mvr;
    ASSERT_EQ(say(kAnn, merge()), "ok") << reply.ShortDebugString();
    EXPECT_EQ(light("A 1").profile->name, "another") << told();
    EXPECT_EQ(light("B 2").profile, mvr->lights[1].profile);
}

// A kept light is none of the scene's file, so a profile that it gets then has to be noted.
TEST_F(MergeTest, AProfileGivenAfterAnotherRoomStaysToo) {
    const auto mvr = asset;
    asset = *load_scene("cornell");
    v1::Command room = load("cornell");
    room.mutable_load_scene()->add_keep("lights");
    ASSERT_EQ(say(kAnn, room), "ok");
    ASSERT_EQ(say(kAnn, command_of([](v1::Command& said) { said.mutable_set_light()->set_name("A 1"); }), another),
              "ok")
        << reply.ShortDebugString();
    say(kAnn, level("B 2", 0.3));
    asset = mvr;
    ASSERT_EQ(say(kAnn, merge()), "ok") << reply.ShortDebugString();
    EXPECT_EQ(light("A 1").profile->name, "another") << told();
    EXPECT_EQ(light("B 2").profile, mvr->lights[1].profile);
    ASSERT_EQ(say(kAnn, merge()), "ok") << "again";
    EXPECT_EQ(light("A 1").profile->name, "another") << told();
}

TEST_F(MergeTest, AProfileGivenToAMissingLightStaysWhenItComesBack) {
    next({a});
    ASSERT_EQ(say(kAnn, merge()), "ok");
    ASSERT_TRUE(light("B 2").missing);
    ASSERT_EQ(say(kAnn, command_of([](v1::Command& said) { said.mutable_set_light()->set_name("B 2"); }), another),
              "ok")
        << reply.ShortDebugString();
    next({a, b});
    ASSERT_EQ(say(kAnn, merge()), "ok") << reply.ShortDebugString();
    EXPECT_FALSE(light("B 2").missing);
    EXPECT_EQ(light("B 2").profile->name, "another") << told();
}

TEST_F(MergeTest, WithoutAUuidItIsFoundByNumberThenByPlace) {
    Par by_number = a, by_place = b;
    by_number.uuid = by_place.uuid = "";
    by_number.name = "A front";
    by_number.at_mm = "7000,0,3000";
    by_place.at_mm = "2050,0,3000";
    const Par was{"B", "F531086D-E77A-51E9-BA85-2232259646E1", "2000,0,3000", "2"};
    by_place.more = "";
    begin({a, was});
    next({by_number, by_place});
    ASSERT_EQ(say(kAnn, merge()), "ok");
    EXPECT_TRUE(tells("matched: \"A 1\" by its number and type")) << told();
    EXPECT_TRUE(tells("matched: \"B\" by its name and place")) << told();
    EXPECT_TRUE(tells("renamed: \"A 1\" to \"A front 1\"")) << told();
    EXPECT_EQ(scene().lights.size(), 2u);
    by_place.at_mm = "2250,0,3000";  // 0.2 m on: it is another one
    next({by_number, by_place});
    ASSERT_EQ(say(kAnn, merge()), "ok");
    EXPECT_TRUE(tells("missing: \"B\"")) << told();
    EXPECT_TRUE(tells("added: \"B 2\"")) << told();
}

TEST_F(MergeTest, WhatIsMissingComesBack) {
    say(kAnn, level("B 2", 0.3));
    next({a});
    ASSERT_EQ(say(kAnn, merge()), "ok");
    ASSERT_TRUE(light("B 2").missing);
    next({a});
    ASSERT_EQ(say(kAnn, merge()), "ok");
    EXPECT_FALSE(tells("missing: ")) << "it is told once: " << told();
    next({a, b});
    ASSERT_EQ(say(kAnn, merge()), "ok");
    EXPECT_TRUE(tells("back: \"B 2\"")) << told();
    EXPECT_FALSE(light("B 2").missing);
    EXPECT_EQ(light("B 2").level_ratio, 0.3);
    EXPECT_EQ(light("B 2").profile, asset->lights[1].profile);
    EXPECT_GT(own_weight(light("B 2")).r, 0.0);
}

TEST_F(MergeTest, WhatWasRemovedHereStaysAway) {
    say(kAnn, removing("B 2"));
    say(kAnn, renaming("A 1", "key"));
    next({a_moved(), b});
    ASSERT_EQ(say(kAnn, merge()), "ok");
    EXPECT_TRUE(tells("kept: \"B 2\" was removed here")) << told();
    ASSERT_EQ(scene().lights.size(), 1u);
    EXPECT_EQ(scene().lights[0].name, "key") << "the file did not rename it";
    EXPECT_EQ(address_of("key"), 1u);
}

TEST_F(MergeTest, TwoThatExchangeTheirNamesKeepTheirShow) {
    say(kAnn, level("A 1", 0.25));
    Par one = a, other = b;
    std::swap(one.name, other.name);
    std::swap(one.more, other.more);
    next({one, other});
    ASSERT_EQ(say(kAnn, merge()), "ok");
    EXPECT_EQ(light("B 2").level_ratio, 0.25) << told();
    EXPECT_EQ(light("A 1").level_ratio, 1.0);
    EXPECT_EQ(address_of("B 2"), 1u);
    EXPECT_EQ(scene().groups.at("Front wash"), (std::vector<std::string>{"B 2", "A 1"}));
}

// All names move on by one, so that every light gets the name of another.
TEST_F(MergeTest, ManyThatMoveOnByOneNameKeepTheirShow) {
    constexpr int kMany = 500;
    const auto pars = [](int first) {
        std::vector<Par> all;
        for (int i = 0; i < kMany; ++i) {
            const std::string number = std::to_string(i + 1);
            const std::string uuid = "8DA19619-C8F6-58B1-ADEB-" + std::string(12 - number.size(), '0') + number;
            all.push_back({"L" + std::to_string(first + i), uuid, std::to_string(100 * i) + ",0,3000", number, "Mode 1",
                           "<FixtureID>1</FixtureID>"});
        }
        return all;
    };
    begin(pars(0));
    ASSERT_EQ(scene().lights.size(), std::size_t{kMany});
    const std::string first_name = scene().lights[0].name, second_name = scene().lights[1].name;
    say(kAnn, level(first_name, 0.25));
    say(kAnn, save("look"));
    for (int i = 0; i < 20; ++i) say(kAnn, save("look " + std::to_string(i)));
    next(pars(1));
    const auto before = std::chrono::steady_clock::now();
    ASSERT_EQ(say(kAnn, merge()), "ok");
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - before;
    RecordProperty("merge_s", std::to_string(took.count()));
    EXPECT_TRUE(tells("renamed: \"" + first_name + "\" to \"" + second_name + "\"")) << told();
    for (const Light& light : scene().lights) {
        const auto index = static_cast<std::uint32_t>(&light - scene().lights.data());
        ASSERT_NEAR(light.position.x, 0.1 * index, 1e-9) << light.name;
        ASSERT_EQ(address_of(light.name), index + 1) << light.name;
    }
    EXPECT_EQ(light(second_name).level_ratio, 0.25);
    const Preset& look = *scene().presets.at("look");
    ASSERT_EQ(look.size(), std::size_t{kMany});
    EXPECT_EQ(look[0].name, second_name);
    EXPECT_EQ(look[0].level_ratio, 0.25);
}

TEST_F(MergeTest, OneOfSeveralOfTheSameNameLeavesTheOthersTheirs) {
    Par one = a, other = b, third = c;
    for (Par* par : {&one, &other, &third}) par->name = "Par", par->more = "";
    begin({one, other, third});
    say(kAnn, level("Par 3", 0.25));
    next({other, third});  // in the file they are "Par" and "Par 2" now
    ASSERT_EQ(say(kAnn, merge()), "ok");
    EXPECT_TRUE(light("Par").missing) << told();
    EXPECT_EQ(light("Par 3").level_ratio, 0.25) << told();
    EXPECT_EQ(address_of("Par 2"), 2u);
    EXPECT_EQ(address_of("Par 3"), 3u);
    EXPECT_TRUE(tells("kept: \"Par 2\" its name: another light or group has \"Par\"")) << told();
}

// The designer wrote the next edition over the file: the saved show alone knows the one before.
TEST_F(MergeTest, TheLastImportIsSavedWithTheShow) {
    say(kAnn, place("B 2", 9));
    next({a, b, c});
    say(kAnn, merge());
    next({a, b});
    say(kAnn, merge());
    ASSERT_TRUE(light("C 3").missing);
    const std::string saved = write_show(gonio::show_of(scene(), texts));
    next({a_moved(), b});
    const auto show = read_show(saved);
    ASSERT_TRUE(show);
    RestoredShow restored = restore_show(*show, asset, true);
    EXPECT_EQ(restored.warnings, std::vector<std::string>{});
    const Light* const gone = find_light(restored.scene, "C 3");
    ASSERT_NE(gone, nullptr);
    EXPECT_TRUE(gone->missing);
    EXPECT_EQ(write_show(gonio::show_of(restored.scene, texts)).find("\"imported_lights\": []"), std::string::npos);
    const auto applied = apply(restored.scene, merge(), {.asset = asset});
    ASSERT_TRUE(applied) << applied.error().text();
    EXPECT_EQ(applied->warnings[0], "merged: added 0, moved 1, mode 0, removed 0, unchanged 1, conflicts 0");
    EXPECT_NEAR(find_light(restored.scene, "A 1")->position.x, 1.0, 1e-9);
    EXPECT_EQ(find_light(restored.scene, "B 2")->position.x, 9.0);
}

TEST_F(MergeTest, WhatCannotBeMergedChangesNothing) {
    const std::string before = text();
    const auto mvr = asset;
    asset = *load_scene("cornell");
    EXPECT_EQ(say(kAnn, merge()), "unsupported");
    EXPECT_EQ(reply.result().field(), "load_scene.merge");
    asset = mvr;
    v1::Command kept = merge();
    kept.mutable_load_scene()->add_keep("lights");
    EXPECT_EQ(say(kAnn, kept), "conflict");
    v1::Command dry = merge(true);
    dry.mutable_load_scene()->set_merge(false);
    EXPECT_EQ(say(kAnn, dry), "invalid_argument");
    auto scaled = std::make_shared<SceneAsset>(*mvr);
    scaled->scale = 0.5;
    asset = scaled;
    EXPECT_EQ(say(kAnn, merge()), "conflict");
    auto moved = std::make_shared<SceneAsset>(*mvr);
    auto said = std::make_shared<Imported>(*mvr->imported);
    said->universe_offset = 10;
    moved->imported = said;
    asset = moved;
    EXPECT_EQ(say(kAnn, merge()), "conflict");
    EXPECT_EQ(reply.result().field(), "load_scene.universe_offset");
    EXPECT_EQ(difference(text(), before), "");
    asset = *load_scene("cornell");
    ASSERT_EQ(say(kAnn, load("cornell")), "ok");
    asset = mvr;
    EXPECT_EQ(say(kAnn, merge()), "unsupported");
    EXPECT_NE(reply.result().message().find("came from no MVR show"), std::string::npos);
}

TEST_F(MergeTest, ListsAreBounded) {
    std::vector<Par> pars, moved;
    for (std::size_t i = 0; i < kMostMergeLines + 6; ++i) {
        const std::string number = std::to_string(100 + i);
        pars.push_back({"P" + number, "00000000-0000-0000-0000-000000000" + number, number + ",0,3000", number});
        moved.push_back(pars.back());
        moved.back().at_mm = number + ",0,4000";
    }
    begin(pars);
    next(moved);
    ASSERT_EQ(say(kAnn, merge()), "ok");
    EXPECT_TRUE(tells("moved 70,")) << told();
    EXPECT_TRUE(tells("moved: and 6 more")) << told();
    const auto lines = warnings();
    EXPECT_EQ(std::ranges::count_if(lines, [](const std::string& line) { return line.starts_with("moved: \""); }), 64);
}

TEST_F(MergeTest, GroupsOfTheFileFollowItAndOnesOwnStay) {
    say(kAnn, group("Front wash", {"B 2"}));  // A was taken out here
    next({a, b, c});
    ASSERT_EQ(say(kAnn, merge()), "ok");
    EXPECT_EQ(scene().groups.at("Front wash"), (std::vector<std::string>{"B 2", "C 3"}));
    EXPECT_TRUE(tells("group: \"Front wash\" has 2 lights")) << told();
    next({a, b, c}, "Back wash");
    ASSERT_EQ(say(kAnn, merge()), "ok");
    EXPECT_FALSE(scene().groups.contains("Front wash"));
    EXPECT_EQ(scene().groups.at("Back wash").size(), 3u);
}

TEST_F(MergeTest, GroupsLayersAndClassesAreGroupsThatAreDimmed) {
    Par warm = b;
    warm.more += "<Classing>c1</Classing>";
    begin({a, warm});
    EXPECT_EQ(scene().groups.at("Front wash"), (std::vector<std::string>{"A 1", "B 2"}));
    EXPECT_EQ(scene().groups.at("Warm"), (std::vector<std::string>{"B 2"}));
    EXPECT_EQ(scene().groups.at("L"), (std::vector<std::string>{"A 1", "B 2"})) << "the layer";
    ASSERT_EQ(say(kAnn, level("Warm", 0.2)), "ok");
    EXPECT_EQ(light("A 1").level_ratio, 1.0);
    EXPECT_EQ(light("B 2").level_ratio, 0.2);
    // A group that was removed does not come back with a saved show.
    say(kAnn, group("L", {}));
    const auto show = read_show(write_show(gonio::show_of(scene(), texts)));
    EXPECT_FALSE(restore_show(*show, asset, true).scene.groups.contains("L"));
}

TEST_F(MergeTest, TheCaseOfTheDesignerWhoSendsItAgain) {
    const auto folder = test::shared_data("cases/47-mvr-reimport");
    if (!folder) GTEST_SKIP() << "the cases are not on this machine";
    asset = test::imported(test::bytes_of(*folder / "show1.mvr"));
    start();
    EXPECT_EQ(scene().groups.at("Front wash"), (std::vector<std::string>{"A 1", "B 2"}));
    EXPECT_EQ(scene().groups.at("FOH"), (std::vector<std::string>{"A 1", "B 2"}));
    say(kAnn, level("FOH", 0.5));
    say(kAnn, save("look"));
    asset = test::imported(test::bytes_of(*folder / "show2.mvr"));
    ASSERT_EQ(say(kAnn, merge()), "ok");
    EXPECT_EQ(warnings()[0], "merged: added 1, moved 1, mode 0, removed 1, unchanged 0, conflicts 0") << told();
    EXPECT_EQ(light("A 1").level_ratio, 0.5);
    EXPECT_NEAR(light("A 1").position.x, 1.0, 1e-9);
    EXPECT_TRUE(light("B 2").missing);
    EXPECT_EQ(scene().presets.count("look"), 1u);
}

}  // namespace
}  // namespace gonio::undo_test
