// MVR shows of the shared cases whose archives are unusual, each against its README, and own shows with the same
// traits. Without the shared folder the tests check their own shows alone.
#include <gtest/gtest.h>

#include <algorithm>

#include "protocol/dmx/patch.h"
#include "protocol/schema/command.pb.h"
#include "protocol/schema/console.pb.h"
#include "server/scene/apply.h"
#include "server/scene/console.h"
#include "server/scene/scene.h"
#include "tests/unit/scene/mvr_shows.h"

namespace gonio {
namespace {

using namespace test;

constexpr const char* kSceneEntry = "GeneralSceneDescription.xml";

std::string spot_text() {
    return "<?xml version=\"1.0\" encoding=\"UTF-8\"?><GeneralSceneDescription verMajor='1' "
           "verMinor='6'><Scene><Layers>"
           "<Layer name='L'><ChildList>" +
           fixture("Spot", kHanging) + "</ChildList></Layer></Layers></Scene></GeneralSceneDescription>";
}

std::string utf16_of(const std::string& ascii, bool big_endian) {
    std::string text = big_endian ? "\xfe\xff" : "\xff\xfe";
    for (const char c : ascii) {
        if (big_endian) text += '\0';
        text += c;
        if (!big_endian) text += '\0';
    }
    return text;
}

// The encodings in which exporters write XML, of this ASCII text.
std::vector<std::pair<const char*, std::string>> encodings_of(const std::string& text) {
    return {{"plain", text},
            {"byte order mark", "\xef\xbb\xbf" + text},
            {"NUL at the end", text + std::string(1, '\0')},
            {"NULs and a line break", text + std::string("\0\0\r\n\0", 5)},
            {"UTF-16 LE", utf16_of(text, false)},
            {"UTF-16 BE", utf16_of(text, true)},
            {"UTF-16 LE and a NUL", utf16_of(text + std::string(1, '\0'), false)}};
}

void expect_one_spot(const SceneAsset& scene) {
    ASSERT_EQ(scene.lights.size(), 1u) << testing::PrintToString(scene.warnings);
    EXPECT_GT(scene.lights[0].profile->flux_lm, 0.0);
}

// 07: python-mvr 0.2.0 met XML that ends in a NUL.
TEST(ExchangeCases, ShowsAreReadInEveryEncoding) {
    for (const auto& [name, text] : encodings_of(spot_text())) {
        SCOPED_TRACE(name);
        expect_one_spot(
            *imported(*write_zip(std::vector<ZipFile>{{kSceneEntry, text}, {"Maker@Head.gdtf", head_gdtf()}})));
    }
    for (const char* name : {"bom.mvr", "nul.mvr", "utf16.mvr"}) {
        SCOPED_TRACE(name);
        if (const std::string file = shared_case_bytes(std::string("07-xml-nul-bom/") + name); !file.empty())
            expect_one_spot(*imported(file));
    }
}

// The same of a fixture type within the show.
TEST(ExchangeCases, FixtureTypesAreReadInEveryEncoding) {
    const std::string type = gdtf_text({.geometries = "<Geometry Name='Base'><Beam Name='Lens' LuminousFlux='10000' "
                                                      "BeamAngle='25' FieldAngle='40'/></Geometry>",
                                        .modes = mode_text("Base", channel_text("Base", "Dimmer", "1"))});
    for (const auto& [name, text] : encodings_of(type)) {
        SCOPED_TRACE(name);
        const std::string gdtf = *write_zip(std::vector<ZipFile>{{"description.xml", text}});
        expect_one_spot(*imported(show_mvr(fixture("Spot", kHanging), {{"Maker@Head.gdtf", gdtf}})));
    }
}

// 09: a show that was unpacked and packed again by its folder, by a system that adds files of its own.
TEST(ExchangeCases, ShowsThatWerePackedAgainLoad) {
    const std::vector<std::vector<ZipFile>> archives = {
        {{"show/GeneralSceneDescription.xml", spot_text()}, {"show/Maker@Head.gdtf", head_gdtf()}},
        {{"__MACOSX/._GeneralSceneDescription.xml", "x"},
         {".DS_Store", "x"},
         {kSceneEntry, spot_text()},
         {"Maker@Head.gdtf", head_gdtf()}},
        {{"__MACOSX/show/._GeneralSceneDescription.xml", "x"},
         {"show/.DS_Store", "x"},
         {"show/GeneralSceneDescription.xml", spot_text()},
         {"show/Maker@Head.gdtf", head_gdtf()}},
    };
    for (std::size_t i = 0; i < archives.size(); ++i) {
        SCOPED_TRACE(i);
        expect_one_spot(*imported(*write_zip(archives[i])));
    }
    for (const char* name : {"show.mvr", "extras.mvr"}) {
        SCOPED_TRACE(name);
        if (const std::string file = shared_case_bytes(std::string("09-rezipped-folder/") + name); !file.empty())
            expect_one_spot(*imported(file));
    }
}

// 11: three slots from the absolute address 511: the third is the first slot of the next universe.
TEST(ExchangeCases, AddressesCrossUniverses) {
    const auto check = [](const std::shared_ptr<SceneAsset>& asset) {
        ASSERT_EQ(asset->lights.size(), 1u) << testing::PrintToString(asset->warnings);
        Scene scene = scene_of(asset);
        PatchReader reader(patch_in_force(scene));
        const auto hear = [&](std::uint16_t number, std::size_t slot, std::uint8_t level) {
            DmxUniverse universe;
            DmxSource& source = universe.sources.emplace_back();
            source.id = 1;
            source.rank.fill(101);
            source.levels[slot - 1] = level;
            const auto values = reader.read({DmxProtocol::sacn, number}, universe);
            for (const auto& refused : apply_inputs(scene, commands_of(scene, values))) EXPECT_FALSE(refused);
            return scene.lights.at(0).color * scene.lights.at(0).level_ratio;
        };
        hear(1, 1, 0);
        const glm::dvec3 blue = hear(2, 1, 255);
        EXPECT_GT(blue.b, 0.5);
        EXPECT_LT(blue.r + blue.g, 0.02 * blue.b) << blue.r << " " << blue.g;
        hear(2, 1, 0);
        const glm::dvec3 red = hear(1, 511, 255);
        EXPECT_LT(red.g + red.b, 0.02 * red.r) << red.g << " " << red.b;
        const glm::dvec3 green = hear(1, 512, 255);
        EXPECT_LT(green.r + green.b, 0.02 * green.g) << green.r << " " << green.b;
    };
    const std::string type = *write_zip(std::vector<ZipFile>{
        {"description.xml",
         gdtf_text({.geometries = "<Geometry Name='Base'><Beam Name='L' LuminousFlux='10000'/></Geometry>",
                    .modes = mode_text("Base", channel_text("Base", "ColorAdd_R", "1") +
                                                   channel_text("Base", "ColorAdd_G", "2") +
                                                   channel_text("Base", "ColorAdd_B", "3"))})}});
    const std::string address = "<Addresses><Address break='0'>511</Address></Addresses>";
    check(imported(show_mvr(fixture("Spot", kHanging, address), {{"Maker@Head.gdtf", type}})));
    if (const std::string file = shared_case_bytes("11-address-crosses-universe/show.mvr"); !file.empty())
        check(imported(file));
}

// 19: a GDTF file alone is no scene; the refusal says so.
TEST(ExchangeCases, AFixtureTypeAloneIsNamedInTheRefusal) {
    const auto refusal = [](const std::string& bytes) {
        const auto scene = exchange::import_mvr(bytes, "par.gdtf", {}, kRoom);
        return scene ? "was read" : scene.error().text();
    };
    std::vector<std::string> files = {head_gdtf()};
    if (const std::string file = shared_case_bytes("19-gdtf-alone/par.gdtf"); !file.empty()) files.push_back(file);
    for (const std::string& file : files) EXPECT_NE(refusal(file).find("GDTF"), std::string::npos) << refusal(file);
}

}  // namespace
}  // namespace gonio
