// MVR files: expected values are from DIN SPEC 15801's examples, what exporters are seen to write, and the samples.
#include "server/exchange/mvr.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "server/exchange/gdtf.h"
#include "tests/shared_data.h"
#include "tests/unit/scene/exchange_test_support.h"

namespace gonio {
namespace {

using exchange::Outcome;
using mvr::Show;

std::string show_text(const std::string& objects, const std::string& aux = "", const std::string& layer = "") {
    return "<GeneralSceneDescription verMajor='1' verMinor='6' provider='Test'><Scene><AUXData>" + aux +
           "</AUXData><Layers><Layer name='Layer' uuid='l'>" + layer + "<ChildList>" + objects +
           "</ChildList></Layer></Layers></Scene></GeneralSceneDescription>";
}

Show show_of(const std::string& objects, const std::string& aux = "", std::vector<std::string> entries = {},
             const mvr::ReadOptions& options = {}) {
    auto show = mvr::read_show(show_text(objects, aux), entries, options);
    EXPECT_TRUE(show) << show.error().text();
    return show ? *show : Show{};
}

std::string matrix(const std::string& text) {
    return "<Matrix>" + text + "</Matrix>";
}

void expect_near(const glm::dvec3& a, const glm::dvec3& b, double most) {
    EXPECT_NEAR(a.x, b.x, most);
    EXPECT_NEAR(a.y, b.y, most);
    EXPECT_NEAR(a.z, b.z, most);
}

TEST(Mvr, TheStandardsFixtureMatrix) {
    const Show show = show_of("<Fixture name='Robe Robin MMX WashBeam'>" +
                              matrix("{0.158127,-0.987419,0.000000}{0.987419,0.158127,0.000000}{0.000000,0.000000,"
                                     "1.000000}{6020.939200,2838.588955,4978.134459}") +
                              "</Fixture>");
    // (1, 0, 0) m of the fixture is (6.179066, 1.851170, 4.978134) m in MVR's axes.
    const glm::dvec3 x = show.objects.at(0).world_from_object * glm::dvec4(1, 0, 0, 1);
    expect_near(x, {6.179066, 4.978134, -1.851170}, 1e-6);
    // Up in MVR (Z) is up in the scene (Y); what an object has along its Z it has along its Y here.
    const glm::dvec3 up = show.objects[0].world_from_object * glm::dvec4(0, 1, 0, 0);
    expect_near(up, {0, 1, 0}, 1e-12);
}

TEST(Mvr, ParentsLayersAndModelsPlace) {
    const std::string objects = "<GroupObject name='Group'>" + matrix("{0,1,0}{-1,0,0}{0,0,1}{1000,0,0}") +
                                "<ChildList><SceneObject name='Desk'>" + matrix("{1,0,0}{0,1,0}{0,0,1}{0,2000,0}") +
                                "<Geometries><Geometry3D fileName='desk.glb'>" +
                                matrix("{2,0,0}{0,2,0}{0,0,2}{0,0,500}") +
                                "</Geometry3D></Geometries></SceneObject></ChildList></GroupObject>";
    const auto show = mvr::read_show(show_text(objects, "", matrix("{1,0,0}{0,1,0}{0,0,1}{0,0,3000}")),
                                     std::vector<std::string>{"desk.glb"});
    ASSERT_TRUE(show);
    // MVR: the desk is at (1000, 0, 3000) + R(0, 2000, 0), R taking y to -x: (-1000, 0, 3000) mm.
    expect_near(show->objects.at(1).world_from_object[3], {-1, 3, 0}, 1e-12);
    EXPECT_EQ(show->objects[1].parent, 0);
    EXPECT_EQ(show->objects[1].layer, 0);
    const glm::dmat4& model = show->models.at(0).world_from_model;
    expect_near(model * glm::dvec4(0, 0, 0, 1), {-1, 3.5, 0}, 1e-12);
    expect_near(model * glm::dvec4(0, 1, 0, 1), {-1, 5.5, 0}, 1e-12);  // a metre of the model's up, twice as large
    EXPECT_EQ(show->report.count(Outcome::guessed), 0u);
}

TEST(Mvr, AddressesAreAbsoluteOrUniverseAndSlot) {
    const auto is = [](const char* text, unsigned universe, unsigned address) {
        const auto read = mvr::address_of(text);
        ASSERT_TRUE(read) << text;
        EXPECT_EQ(read->universe, universe) << text;
        EXPECT_EQ(read->address, address) << text;
    };
    is("513", 2, 1);
    is("1", 1, 1);
    is("512", 1, 512);
    is(" 3.45 ", 3, 45);
    for (const char* text : {"0", "", "a", "-1", "1.0", "1.513", "0.1", "99999999999999", "2,5", "2/5", "1.1.1", "0x10",
                             "2 5", "2a", "+-2", "1.2,5"})
        EXPECT_FALSE(mvr::address_of(text)) << text;
}

TEST(Mvr, BreaksCountFromZeroAndUniversesMayBeMoved) {
    const Show show = show_of(
        "<Fixture name='A'><Addresses><Address break='0'>513</Address><Address break='2'>1.7</Address></Addresses>"
        "</Fixture><Fixture name='B'><Addresses><Address break='1'>9</Address></Addresses></Fixture>"
        "<Fixture name='C'><Addresses><Address>0</Address></Addresses></Fixture>",
        "", {}, {.universe_offset = 10});
    EXPECT_EQ(show.fixtures.at(0).patches, (std::vector<mvr::Patch>{{1, 12, 1}, {3, 11, 7}}));
    EXPECT_EQ(show.fixtures.at(1).patches, (std::vector<mvr::Patch>{{1, 11, 9}})) << "its exporter counts from 1";
    EXPECT_EQ(show.report.count(Outcome::guessed, "a fixture's breaks count from 1"), 1u);
    EXPECT_TRUE(show.fixtures.at(2).patches.empty()) << "0 is unpatched";
    EXPECT_EQ(show.report.count(Outcome::left_out, "a fixture is not patched"), 1u);
}

TEST(Mvr, BreaksAndUniversesBeyondWhatThereIsAreLeftOut) {
    const std::string far = "9223372036854775807";
    const Show show =
        show_of("<Fixture name='A'><Addresses><Address break='0'>7</Address><Address break='" + far +
                    "'>1</Address><Address break='-" + far +
                    "'>1</Address><Address break='511'>8</Address>"
                    "<Address break='512'>1</Address><Address break='1'>" +
                    far + "</Address><Address break='1'>" + far + "." + far + "</Address></Addresses></Fixture>",
                "", {}, {.universe_offset = 2147483647});
    EXPECT_TRUE(show.fixtures.at(0).patches.empty()) << "the moved universes are far too";
    EXPECT_EQ(show.report.count(Outcome::left_out, "an address lies beyond what there is"), 5u);
    EXPECT_EQ(show.report.count(Outcome::left_out, "an address is none"), 2u);
    const Show unmoved = show_of("<Fixture name='A'><Addresses><Address break='0'>7</Address><Address break='" + far +
                                 "'>1</Address><Address break='511'>8</Address></Addresses></Fixture>");
    EXPECT_EQ(unmoved.fixtures.at(0).patches, (std::vector<mvr::Patch>{{1, 1, 7}, {512, 1, 8}}));
    EXPECT_EQ(unmoved.report.count(Outcome::left_out, "an address lies beyond what there is"), 1u);
}

TEST(Mvr, AFixtureOfAMultipatchHasTheOthersPatch) {
    const Show show = show_of(
        "<Fixture name='B' uuid='b' multipatch='4AB19462A6E34C3BB25AD8099F78170C'/>"
        "<Fixture name='A' uuid='4AB19462-A6E3-4C3B-B25A-D8099F78170C'><Addresses><Address>7</Address></Addresses>"
        "</Fixture>");
    EXPECT_EQ(show.fixtures.at(0).patches, (std::vector<mvr::Patch>{{1, 1, 7}}));
    EXPECT_EQ(show.report.count(Outcome::left_out, "a fixture is not patched"), 0u);
}

TEST(Mvr, AMultipatchIsFollowedToItsEnd) {
    const auto fixture = [](const std::string& name, const std::string& leader, const std::string& address = "") {
        return "<Fixture name='" + name + "' uuid='" + name + "' multipatch='" + leader + "'><Addresses>" + address +
               "</Addresses></Fixture>";
    };
    const std::string a = fixture("a", "b"), b = fixture("b", "c"), c = fixture("c", "", "<Address>7</Address>");
    for (const std::string& order : {a + b + c, c + b + a, b + c + a, b + a + c}) {
        const Show show = show_of(order);
        for (const mvr::Fixture& one : show.fixtures) EXPECT_EQ(one.patches, (std::vector<mvr::Patch>{{1, 1, 7}}));
        EXPECT_EQ(show.report.count(Outcome::left_out, "a fixture is not patched"), 0u);
    }
    const Show circle = show_of(fixture("tail", "a") + a + b + fixture("c", "a") + fixture("self", "self"));
    EXPECT_EQ(circle.report.count(Outcome::left_out, "a multipatch leads back to itself"), 2u);
    EXPECT_EQ(circle.report.count(Outcome::left_out, "a fixture is not patched"), 5u);
    std::string chain = fixture("n0", "", "<Address>9</Address>");
    for (int i = 50'000; i > 0; --i) chain += fixture("n" + std::to_string(i), "n" + std::to_string(i - 1));
    EXPECT_EQ(show_of(chain).fixtures.at(1).patches, (std::vector<mvr::Patch>{{1, 1, 9}}));
}

// DIN SPEC 15801: a Layer holds Matrix and ChildList; a Symdef Geometry3D and Symbol; a Scene one AUXData and one
// Layers.
TEST(Mvr, ElementsInTheWrongPlaceAreCountedByName) {
    const std::string text =
        "<GeneralSceneDescription><Scene><AUXData><Symdef name='S' uuid='s'><SceneObject name='In'/><ChildList>"
        "<Geometries/><Geometries/><Geometry3D fileName='a.3ds'/></ChildList></Symdef></AUXData><Layers><Layer "
        "name='L'><Fixture name='Stray'/><Truss name='Bar'/><Truss name='Bar 2'/><ChildList><GroupObject name='G'>"
        "<Fixture name='Lost'/><ChildList/><ChildList/></GroupObject><FocusPoint name='F'><Geometries><Symbol "
        "symdef='s'/></Geometries>"
        "</FocusPoint><SceneObject name='O'><Geometries><Symbol symdef='s'/><Symbol symdef='s'/><Sphere/></Geometries>"
        "</SceneObject><Fixture name='Gel'><Color>0.6,0.3,20</Color></Fixture><Fixture name='Open'><Color>"
        "0.312700,0.329000,100.0</Color></Fixture></ChildList><ChildList><Truss/></ChildList></Layer></Layers>"
        "<Layers><Layer name='Second'/></Layers></Scene></GeneralSceneDescription>";
    const auto show = mvr::read_show(text, std::vector<std::string>{"a.3ds"});
    ASSERT_TRUE(show) << show.error().text();
    EXPECT_EQ(show->models.size(), 2u);
    const auto lines = exchange::report_lines(show->report);
    for (const char* line :
         {"left out: SceneObject of a symbol: \"S\"", "left out: Geometries of a symbol: \"S\", \"S\"",
          "left out: Fixture of a layer: \"Stray\"", "left out: Truss of a layer: \"Bar\", \"Bar 2\"",
          "left out: a further ChildList of a layer: \"L\"", "left out: a further Layers of a scene",
          "left out: Fixture of an object, outside of its ChildList: \"Lost\"",
          "left out: a further ChildList of an object: \"G\"", "left out: Geometries of a focus point: \"F\"",
          "left out: Sphere of an object's Geometries: \"O\"",
          "left out: Color of a fixture: it lights without a gel: \"Gel\""})
        EXPECT_EQ(std::count(lines.begin(), lines.end(), line), 1) << line;
}

TEST(Mvr, BackslashesOfFileNamesAreSlashesAsInArchives) {
    const Show show = show_of(
        "<SceneObject name='A'><Geometries><Geometry3D fileName='x\\b.glb'/><Geometry3D fileName='y\\b.glb'/>"
        "</Geometries></SceneObject>",
        "", {"x/b.glb", "y/b.glb"});
    ASSERT_EQ(show.models.size(), 2u);
    EXPECT_EQ(show.models[0].entry, "x/b.glb");
    EXPECT_EQ(show.models[1].entry, "y/b.glb");
    EXPECT_EQ(show.report.count(Outcome::guessed), 0u);
}

TEST(Mvr, GdtfSpecWithoutExtensionOrEmpty) {
    const Show show = show_of(
        "<Fixture name='A'><GDTFSpec>Custom@Robe v1.2</GDTFSpec></Fixture><Fixture name='B'><GDTFSpec/></Fixture>"
        "<Fixture name='C'><GDTFSpec>a/b/CUSTOM@Robe V1.2.GDTF</GDTFSpec></Fixture>"
        "<Fixture name='D'><GDTFSpec>Nobody@None.gdtf</GDTFSpec></Fixture>",
        "", {"Custom@Robe v1.2.gdtf"});
    EXPECT_EQ(show.fixtures.at(0).entry, "Custom@Robe v1.2.gdtf");
    EXPECT_EQ(show.fixtures.at(1).entry, "");
    EXPECT_EQ(show.fixtures.at(2).entry, "Custom@Robe v1.2.gdtf");
    EXPECT_EQ(show.fixtures.at(3).entry, "");
    EXPECT_EQ(show.report.count(Outcome::left_out, "a fixture names no GDTF file"), 1u);
    EXPECT_EQ(show.report.count(Outcome::left_out, "a fixture's GDTF file is not in the archive"), 1u);
    EXPECT_EQ(show.report.count(Outcome::guessed, "a GDTF file was found by another name"), 1u);
}

TEST(Mvr, EmptyGdtfModeIsTheFirst) {
    gdtf::FixtureType type;
    type.modes.resize(2);
    type.modes[0].name = "Basic";
    type.modes[1].name = "Extended";
    EXPECT_FALSE(gdtf::find_mode(type, "").as_named);
    EXPECT_EQ(gdtf::find_mode(type, "").index, 0u);
    EXPECT_EQ(gdtf::find_mode(type, " extended").index, 1u);
    EXPECT_TRUE(gdtf::find_mode(type, " extended").as_named);
}

TEST(Mvr, EmptyAllZeroAndOddMatrices) {
    const Show show = show_of("<SceneObject name='A'><Matrix/></SceneObject><SceneObject name='B'>" +
                              matrix("{0,0,0}{0,0,0}{0,0,0}{0,0,0}") + "</SceneObject><SceneObject name='C'>" +
                              matrix("{nan,0,0}{0,1,0}{0,0,1}{1,2,3}") + "</SceneObject><SceneObject name='D'>" +
                              matrix("{1,0,0}{0,1,0}{0,0,1e300}{1,2,3}") + "</SceneObject><SceneObject name='E'>" +
                              matrix("{1,0,0,0}{0,1,0,0}{0,0,1,0}{1000,0,0,1}") + "</SceneObject>");
    for (int i = 0; i < 4; ++i)
        EXPECT_EQ(show.objects.at(static_cast<std::size_t>(i)).world_from_object, glm::dmat4(1.0));
    expect_near(show.objects.at(4).world_from_object[3], {1, 0, 0}, 1e-12);
    EXPECT_EQ(show.report.count(Outcome::defaulted, "an empty matrix: it is where its parent is"), 2u);
    EXPECT_EQ(
        show.report.count(Outcome::defaulted, "a matrix is not of numbers up to 1,000 km: it is where its parent is"),
        2u);
}

// DIN SPEC 15801: integers and floats are those of XML; a decimal comma is none.
TEST(Mvr, NumbersWithTextBehindThemAreNoneAndAreNamed) {
    const Show show = show_of(
        "<Fixture name='A'>" + matrix("{1;0;0}{0;1;0}{0;0;1}{1000,5;0;0}") +
        "<FixtureIDNumeric>7b</FixtureIDNumeric><Color>0,31;0,33;100</Color><Addresses><Address break='0'>2,5</Address>"
        "<Address break='1,5'>9</Address></Addresses></Fixture><Fixture name='B'><Addresses><Address break='0'>0.0"
        "</Address></Addresses></Fixture>");
    EXPECT_EQ(show.objects.at(0).world_from_object, glm::dmat4(1.0));
    EXPECT_FALSE(show.fixtures.at(0).fixture_id_numeric);
    EXPECT_FALSE(show.fixtures[0].color);
    EXPECT_EQ(show.fixtures[0].patches, (std::vector<mvr::Patch>{{1, 1, 9}})) << "a break's default is 0";
    const auto lines = exchange::report_lines(show.report);
    for (const char* line :
         {"defaulted: a matrix is not of numbers up to 1,000 km: it is where its parent is: \"A "
          "Matrix={1;0;0}{0;1;0}{0;0;1}{1000,5;0;0\"",
          "defaulted: a value is no number: its default stands: \"A FixtureIDNumeric=7b\", \"A break=1,5\"",
          "left out: a fixture's colour is none: \"A Color=0,31;0,33;100\"", "left out: an address is none: \"A: 2,5\"",
          "left out: a fixture is not patched: \"B\""})
        EXPECT_EQ(std::count(lines.begin(), lines.end(), line), 1) << line;
}

TEST(Mvr, ParentsThatCannotBeInvertedKeepTheirPosition) {
    const Show show = show_of("<GroupObject name='Flat'>" + matrix("{1,0,0}{1,0,0}{0,0,0}{0,0,1000}") +
                              "<ChildList><Fixture name='A'>" + matrix("{1,0,0}{0,1,0}{0,0,1}{500,0,0}") +
                              "</Fixture></ChildList></GroupObject>");
    expect_near(show.objects.at(1).world_from_object[3], {0.5, 1, 0}, 1e-12);
    EXPECT_GT(std::abs(glm::determinant(show.objects[1].world_from_object)), 0.5);
    EXPECT_EQ(show.report.count(Outcome::guessed, "a matrix's axes span no space: only its position was taken"), 1u);
}

TEST(Mvr, UuidsInSpacedHexAndTwice) {
    EXPECT_EQ(mvr::plain_uuid("4A B1 94 62 A6 E3 4C 3B B2 5A D8 09 9F 78 17 0C"),
              "4AB19462-A6E3-4C3B-B25A-D8099F78170C");
    EXPECT_EQ(mvr::plain_uuid("{4ab19462-a6e3-4c3b-b25a-d8099f78170c}"), "4AB19462-A6E3-4C3B-B25A-D8099F78170C");
    EXPECT_EQ(mvr::plain_uuid(" some text "), "some text");
    const Show show = show_of(
        "<Fixture name='A' uuid='1'><Focus>4A B1 94 62 A6 E3 4C 3B B2 5A D8 09 9F 78 17 0C</Focus>"
        "<Position>77 BC DE 16 95 A6 47 25 9D 04 16 A0 BD 67 CD 1A</Position></Fixture>"
        "<Fixture name='B' uuid='1'><Focus>nowhere</Focus></Fixture>"
        "<FocusPoint name='Stage' uuid='4AB19462-A6E3-4C3B-B25A-D8099F78170C'>" +
            matrix("{1,0,0}{0,1,0}{0,0,1}{1000,2000,3000}") + "</FocusPoint>",
        "<Position name='Truss 1' uuid='77bcde16-95a6-4725-9d04-16a0bd67cd1a'/>");
    ASSERT_EQ(show.fixtures.at(0).focus, 0);
    expect_near(show.focus_points.at(0).position, {1, 3, -2}, 1e-12);
    EXPECT_EQ(show.fixtures[0].position, "Truss 1");
    EXPECT_EQ(show.fixtures.at(1).focus, -1);
    EXPECT_EQ(show.report.count(Outcome::left_out, "a fixture's focus point does not exist"), 1u);
    EXPECT_EQ(show.report.count(Outcome::guessed, "two objects have one UUID: what refers to it means the first"), 1u);
}

TEST(Mvr, SymbolsNestAndMayNotContainThemselves) {
    const std::string aux = "<Symdef name='Outer' uuid='outer'><ChildList><Symbol uuid='1' symdef='inner'>" +
                            matrix("{1,0,0}{0,1,0}{0,0,1}{0,0,1000}") +
                            "</Symbol><Symbol uuid='2' symdef='outer'/></ChildList></Symdef>"
                            "<Symdef name='Inner' uuid='inner'><Geometry3D fileName='leg.3ds'/></Symdef>";
    const Show show = show_of("<Truss name='T'>" + matrix("{1,0,0}{0,1,0}{0,0,1}{2000,0,0}") +
                                  "<Geometries><Symbol symdef='outer'/><Symbol symdef='gone'/></Geometries></Truss>",
                              aux, {"leg.3ds"});
    ASSERT_EQ(show.models.size(), 1u);
    expect_near(show.models[0].world_from_model[3], {2, 1, 0}, 1e-12);
    EXPECT_EQ(show.report.count(Outcome::left_out, "a symbol contains itself"), 1u);
    EXPECT_EQ(show.report.count(Outcome::left_out, "a symbol is not defined"), 1u);
}

TEST(Mvr, ASymbolShownOftenIsReadOnce) {
    // Walked anew each time these would be 10^10 elements: the test would take a minute.
    std::string strange, symbols;
    for (int i = 0; i < 1'000'000; ++i) strange += "<a/>";
    for (int i = 0; i < 10'000; ++i)
        symbols += "<Symbol symdef='s'>" + matrix("{1,0,0}{0,1,0}{0,0,1}{0,0," + std::to_string(i) + "}") + "</Symbol>";
    const Show show =
        show_of("<Truss name='T'><Geometries>" + symbols + "</Geometries></Truss>",
                "<Symdef name='S' uuid='s'><ChildList>" + strange + "<Geometry3D fileName='leg.3ds'>" +
                    matrix("{1,0,0}{0,1,0}{0,0,1}{2000,0,0}") + strange + "</Geometry3D></ChildList></Symdef>",
                {"leg.3ds"});
    ASSERT_EQ(show.models.size(), 10'000u);
    for (const std::size_t i : {0u, 1u, 9'999u})
        expect_near(show.models[i].world_from_model[3], {2, static_cast<double>(i) / 1000, 0}, 1e-12);
}

TEST(Mvr, SymbolsThatMultiplyAreRefusedAtTheBound) {
    std::string aux;
    for (int level = 0; level < 20; ++level) {
        aux += "<Symdef uuid='s" + std::to_string(level) + "'>";
        for (int i = 0; i < 10; ++i) aux += "<Symbol symdef='s" + std::to_string(level + 1) + "'/>";
        aux += "</Symdef>";
    }
    const auto show =
        mvr::read_show(show_text("<SceneObject><Geometries><Symbol symdef='s0'/></Geometries></SceneObject>", aux), {});
    ASSERT_FALSE(show);
    EXPECT_EQ(show.error().code, "too_large");
}

TEST(Mvr, FilesThatAreOnlyAnExtensionOrInFolders) {
    const Show show = show_of(
        "<SceneObject name='A'><Geometries><Geometry3D fileName='.3ds'/><Geometry3D fileName='models\\Chair.3DS'/>"
        "<Geometry3D fileName='Chair'/><Geometry3D fileName=''/></Geometries></SceneObject>",
        "", {"chair.3ds", ".3ds"});
    EXPECT_EQ(show.models.size(), 2u);
    EXPECT_EQ(show.report.count(Outcome::left_out, "a model's file is not in the archive"), 2u);
    EXPECT_EQ(show.report.count(Outcome::guessed, "a model's file was found by another name"), 2u);
}

TEST(Mvr, LargeShowsAreRead) {
    std::string objects;
    std::vector<std::string> entries;
    for (int i = 0; i < 2078; ++i)
        objects += "<SceneObject name='o" + std::to_string(i) + "'><Geometries><Geometry3D fileName='f" +
                   std::to_string(i % 1000) + ".3ds'/></Geometries></SceneObject>";
    for (int i = 0; i < 1000; ++i) entries.push_back("f" + std::to_string(i) + ".3ds");
    const Show show = show_of(objects, "", entries);
    EXPECT_EQ(show.objects.size(), 2078u);
    EXPECT_EQ(show.models.size(), 2078u);
}

TEST(Mvr, BoundsOfObjectsAndDepth) {
    std::string many;
    for (int i = 0; i < 100'001; ++i) many += "<SceneObject/>";
    const auto refused = mvr::read_show(show_text(many), {});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, "too_large");
    std::string deep, end;
    for (int i = 0; i < 100; ++i) {
        deep += "<GroupObject name='g'><ChildList>";
        end += "</ChildList></GroupObject>";
    }
    const Show show = show_of(deep + end);
    EXPECT_EQ(show.objects.size(), static_cast<std::size_t>(mvr::kMaxDepth));
    EXPECT_EQ(show.report.count(Outcome::left_out, "an object lies too deep"), 1u);
    for (const char* text : {"", "<a/>", "<GeneralSceneDescription/>", "<GeneralSceneDescription><Scene>"})
        EXPECT_EQ(mvr::read_show(text, {}).error().code, "bad_mvr") << text;
}

TEST(Mvr, WhatFixturesSayIsKeptAndWhatIsNotReadIsNamed) {
    const Show show = show_of(
        "<Fixture name='A'><Classing>c</Classing><FixtureID>101</FixtureID><FixtureIDNumeric>7</FixtureIDNumeric>"
        "<UnitNumber>3</UnitNumber><CustomId>9</CustomId><DMXInvertPan>true</DMXInvertPan><CastShadow>false</"
        "CastShadow>"
        "<Color>0.3127,0.3290,99.9</Color><CustomCommands><CustomCommand>Yoke_Pan.Pan.Pan 1,f 45.0</CustomCommand>"
        "</CustomCommands><Gobo rotation='3'>star</Gobo></Fixture><Sphere/>",
        "<Class name='Wash' uuid='c'/>");
    const mvr::Fixture& fixture = show.fixtures.at(0);
    EXPECT_EQ(show.classes.at(static_cast<std::size_t>(show.objects.at(0).object_class)).name, "Wash");
    EXPECT_EQ(fixture.fixture_id, "101");
    EXPECT_EQ(fixture.fixture_id_numeric, 7);
    EXPECT_EQ(fixture.unit_number, "3");
    EXPECT_EQ(fixture.custom_id, "9");
    EXPECT_TRUE(fixture.invert_pan);
    EXPECT_FALSE(fixture.invert_tilt);
    EXPECT_FALSE(fixture.casts_shadow);
    EXPECT_EQ(fixture.color->at(2), 99.9);
    EXPECT_EQ(fixture.commands, (std::vector<std::string>{"Yoke_Pan.Pan.Pan 1,f 45.0"}));
    EXPECT_EQ(show.report.count(Outcome::left_out, "a fixture's gobo is not in the archive"), 1u);
    EXPECT_NEAR(fixture.gobo_rad, 3.0 * std::numbers::pi / 180.0, 1e-12);
    EXPECT_EQ(show.report.count(Outcome::left_out, "there is no such object"), 1u);
}

TEST(Mvr, TheReportGathersNotesOfOneKind) {
    exchange::ImportReport report;
    report.add(Outcome::left_out, "a model's file is not in the archive", "x.3ds");
    for (int i = 0; i < 10; ++i) report.add(Outcome::taken, "fixture", "f" + std::to_string(i));
    EXPECT_EQ(exchange::taken_lines(report),
              std::vector<std::string>{
                  "taken: fixture: \"f0\", \"f1\", \"f2\", \"f3\", \"f4\", \"f5\", \"f6\", \"f7\" and 2 more"});
    EXPECT_EQ(exchange::report_lines(report),
              std::vector<std::string>{"left out: a model's file is not in the archive: \"x.3ds\""});
}

TEST(Mvr, AReportOfALargeShowKeepsWhatWasLeftOut) {
    exchange::ImportReport report;
    for (int i = 0; i < 100'000; ++i) report.add(Outcome::taken, "fixture", "f" + std::to_string(i));
    for (int i = 0; i < 10; ++i) report.add(Outcome::left_out, "a fixture is not patched", "g" + std::to_string(i));
    report.add(Outcome::left_out, "the bodies of fixtures are not drawn");
    EXPECT_EQ(report.count(Outcome::taken), 100'000u);
    EXPECT_EQ(report.count(Outcome::left_out), 11u);
    const std::vector<std::string> lines = {
        "left out: a fixture is not patched: \"g0\", \"g1\", \"g2\", \"g3\", \"g4\", \"g5\", \"g6\", \"g7\" and 2 more",
        "left out: the bodies of fixtures are not drawn"};
    EXPECT_EQ(exchange::report_lines(report), lines);
    EXPECT_EQ(exchange::taken_lines(report),
              std::vector<std::string>{
                  "taken: fixture: \"f0\", \"f1\", \"f2\", \"f3\", \"f4\", \"f5\", \"f6\", \"f7\" and 99992 more"});
    exchange::ImportReport sum;
    sum.add(report);
    EXPECT_EQ(exchange::report_lines(sum), lines);
    sum.add(report, "Type");
    EXPECT_EQ(sum.count(Outcome::left_out, "a fixture is not patched"), 20u);
    EXPECT_EQ(exchange::report_lines(sum).back(), "left out: the bodies of fixtures are not drawn: \"Type\"");
    exchange::ImportReport named;
    named.add(report, "Type");
    EXPECT_EQ(named.notes.at(1).names.at(1), "Type: g1");
}

TEST(Mvr, AReportHasAtMost1000DifferentNotes) {
    exchange::ImportReport report;
    for (int i = 0; i < 1'003; ++i) report.add(Outcome::guessed, "warning " + std::to_string(i), "a.glb");
    report.add(Outcome::guessed, "warning 999", "b.glb");
    EXPECT_EQ(report.notes.size(), 1'000u);
    EXPECT_EQ(report.unlisted, 3u);
    const auto lines = exchange::report_lines(report);
    ASSERT_EQ(lines.size(), 1'001u);
    EXPECT_EQ(lines[999], "guessed: warning 999: \"a.glb\", \"b.glb\"");
    EXPECT_EQ(lines[1'000], "left out: 3 more notes of this report");
}

TEST(Mvr, Samples) {
    const auto folder = test::shared_data("formats");
    if (!folder) GTEST_SKIP() << "the samples are not on this machine";
    const auto read = [&](const char* name) {
        const auto archive = open_zip(test::bytes_of(*folder / "mvr" / name), mvr::kMvrLimits);
        EXPECT_TRUE(archive);
        auto show = mvr::read_mvr(*archive);
        EXPECT_TRUE(show) << show.error().text();
        return *show;
    };
    const Show seven = read("7-fixtures-sample.mvr");
    EXPECT_EQ(seven.provider, "Vectorworks");
    EXPECT_EQ(seven.layers.size(), 5u);
    EXPECT_EQ(seven.classes.size(), 1u);
    ASSERT_EQ(seven.fixtures.size(), 7u);
    EXPECT_EQ(seven.fixtures[0].entry, "Custom@Light Instr Robe ColorWash 2500 AT.gdtf");
    EXPECT_EQ(seven.fixtures[0].mode, "DMX Mode");
    EXPECT_TRUE(seven.fixtures[0].patches.empty());
    EXPECT_EQ(seven.fixtures[0].commands.size(), 3u);
    // {0,-1,0}{0,0,-1}{1,0,0}{5000,0,0}: five metres along X, its own up (Z) along X.
    expect_near(seven.objects[1].world_from_object[3], {5, 0, 0}, 1e-12);
    expect_near(seven.objects[1].world_from_object * glm::dvec4(0, 1, 0, 0), {1, 0, 0}, 1e-12);
    expect_near(seven.objects[2].world_from_object[3], {0, 0, -5}, 1e-12);  // MVR's y = 5000
    expect_near(seven.objects[3].world_from_object[3], {0, 5, 0}, 1e-12);   // z = 5000
    EXPECT_EQ(seven.report.count(Outcome::taken, "fixture"), 7u);
    EXPECT_EQ(seven.report.count(Outcome::left_out, "a fixture is not patched"), 7u);
    const Show basic = read("basic_fixture.mvr");
    ASSERT_EQ(basic.fixtures.size(), 1u);
    EXPECT_EQ(basic.fixtures[0].entry, "LED PAR 64 RGBW.gdtf");
    EXPECT_EQ(basic.fixtures[0].mode, "Default");
    expect_near(basic.objects.at(0).world_from_object[3], {5, 5, -5}, 1e-12);
    EXPECT_EQ(basic.symbols.at(0).name, "Metric Cables H07RN-F 1.5");
}

}  // namespace
}  // namespace gonio
