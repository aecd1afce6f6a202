// A wheel's pictures are decoded when they are first shown, each once, and none while a show is loaded.
#include "server/scene/packed_gobo.h"

#include <gtest/gtest.h>

#include "protocol/schema/command.pb.h"
#include "server/assets/assets.h"
#include "server/exchange/gobo_image.h"
#include "server/exchange/import_parts.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "tests/unit/scene/mvr_shows.h"

namespace gonio {
namespace {

using namespace test;

// The left half is dark.
std::string half_png(int size_px = 64) {
    Image half{size_px, size_px, {}};
    for (int i = 0; i < size_px * size_px; ++i) {
        const auto value = static_cast<std::uint8_t>(i % size_px < size_px / 2 ? 0 : 255);
        half.rgba.insert(half.rgba.end(), {value, value, value, 255});
    }
    const auto png = encode_rgba_png(half);
    return {reinterpret_cast<const char*>(png->data()), png->size()};
}

// A head whose wheel has an open slot, three halves, a picture that ends early, and a file that is none.
std::string pictures_gdtf() {
    std::string sets, slots = "<Slot Name='Open'/>";
    std::vector<ZipFile> files;
    int slot = 1;
    for (const char* name : {"half", "second", "third", "torn", "none"}) {
        slots += std::string("<Slot Name='") + name + "' MediaFileName='" + name + "'/>";
        sets += "<ChannelSet DMXFrom='" + std::to_string(20 * slot) + "/1' WheelSlotIndex='" +
                std::to_string(slot + 1) + "'/>";
        files.push_back({std::string("wheels/") + name + ".png", half_png()});
        ++slot;
    }
    files[3].bytes.resize(files[3].bytes.size() / 2);
    files[4].bytes = "no picture";
    const std::string channel =
        "<DMXChannel DMXBreak='1' Offset='1' Geometry='Base'><LogicalChannel Attribute='Gobo1'><ChannelFunction "
        "Attribute='Gobo1' DMXFrom='0/1' Default='0/1' PhysicalFrom='0' PhysicalTo='1' Wheel='Gobos'>" +
        sets + "</ChannelFunction></LogicalChannel></DMXChannel>";
    files.insert(
        files.begin(),
        {"description.xml", gdtf_text({.geometries = "<Geometry Name='Base'><Beam Name='Lens' LuminousFlux='10000' "
                                                     "BeamAngle='25' FieldAngle='40'/></Geometry>",
                                       .modes = mode_text("Base", channel),
                                       .wheels = "<Wheel Name='Gobos'>" + slots + "</Wheel>"})});
    return *write_zip(files);
}

int decoded_of(const Gobos& gobos) {
    return static_cast<int>(std::ranges::count_if(gobos, [](const Gobo& gobo) {
        return gobo.packed && (!gobo.packed->made.empty() || !gobo.packed->failed.empty());
    }));
}

TEST(PackedGobo, IsDecodedWhenItIsFirstShown) {
    const auto asset = imported(show_mvr(fixture("Spot", kHanging), {{"Maker@Head.gdtf", pictures_gdtf()}}));
    ASSERT_TRUE(asset->lights[0].profile->gobos);
    const Gobos& gobos = *asset->lights[0].profile->gobos;
    ASSERT_EQ(gobos.size(), 6u);
    EXPECT_EQ(gobos[0].size_px, 0);
    EXPECT_EQ(gobos[1].size_px, 64);
    EXPECT_EQ(gobos[5].size_px, 0) << "no picture";
    EXPECT_EQ(decoded_of(gobos), 0) << "while the show is loaded";

    Scene scene = scene_of(asset);
    EXPECT_EQ(decoded_of(gobos), 0) << "while all are open";
    const auto show = [&](double number) {
        v1::Command command;
        command.mutable_set_light()->set_name("Spot");
        command.mutable_set_light()->set_gobo(number);
        const auto applied = apply(scene, command, {});
        EXPECT_TRUE(applied);
        return applied ? applied->warnings : std::vector<std::string>{"refused"};
    };
    EXPECT_TRUE(show(2).empty());
    EXPECT_EQ(decoded_of(gobos), 1);
    EXPECT_NEAR(scene.lights[0].shining()->flux_lm, 5000, 10);
    EXPECT_TRUE(show(4).empty());
    EXPECT_TRUE(show(2).empty());
    EXPECT_EQ(decoded_of(gobos), 2);

    const auto warnings = show(5);
    ASSERT_EQ(warnings.size(), 1u) << "one that cannot be decoded";
    EXPECT_NE(warnings[0].find("gobo 5 of 'Spot'"), std::string::npos) << warnings[0];
    EXPECT_NE(warnings[0].find("torn"), std::string::npos) << warnings[0];
    EXPECT_NEAR(scene.lights[0].shining()->flux_lm, 10000, 10) << "is open";
    EXPECT_TRUE(show(2).empty());
    EXPECT_TRUE(show(5).empty()) << "it is told once";
    EXPECT_EQ(decoded_of(gobos), 3);
}

int decodes = 0;

TEST(PackedGobo, IsDecodedOnceAndAsItsHeaderSays) {
    const auto packed = [](PackedGobo::Decode decode) {
        auto made = std::make_shared<PackedGobo>();
        made->decode = decode;
        Gobo gobo;
        gobo.size_px = 2;
        gobo.packed = std::move(made);
        return gobo;
    };
    const Gobo good = packed([](std::string_view, const std::string&) {
        ++decodes;
        return Result<std::vector<std::uint16_t>>(std::vector<std::uint16_t>{0, 1, 2, 3});
    });
    const Gobo copy = good;
    EXPECT_EQ(transmission_of(good).size(), 4u);
    EXPECT_EQ(transmission_of(copy)[3], 3);
    EXPECT_EQ(decodes, 1);
    const Gobo other = packed([](std::string_view, const std::string&) {
        return Result<std::vector<std::uint16_t>>(std::vector<std::uint16_t>{0});
    });
    EXPECT_TRUE(transmission_of(other).empty());
    EXPECT_NE(other.packed->failed.find("size"), std::string::npos);
}

TEST(PackedGobo, OnlyTheHeaderIsReadFirst) {
    EXPECT_EQ(exchange::packed_gobo(half_png(300), "a.png")->size_px, 256);
    EXPECT_EQ(exchange::packed_gobo(half_png().substr(0, 40), "a.png")->size_px, 64);
    for (const std::string& bad : {std::string(), std::string("GIF89a"), half_png().substr(0, 20)})
        EXPECT_EQ(exchange::packed_gobo(bad, "a.png").error().code, "bad_image");
    std::string large = half_png();
    large[18] = '\x10';  // 4,160 pixels wide
    large[22] = '\x10';
    EXPECT_EQ(exchange::packed_gobo(large, "a.png").error().code, "too_large");
}

}  // namespace
}  // namespace gonio
