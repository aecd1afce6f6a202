// Models of shows and of fixture types that cannot be shown whole: what the report says of them.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>

#include "server/scene/body.h"
#include "server/scene/scene.h"
#include "tests/unit/scene/mvr_shows.h"

namespace gonio {
namespace {

using namespace test;

std::string little_endian(std::uint32_t value, int bytes) {
    std::string result;
    for (int i = 0; i < bytes; ++i) result.push_back(static_cast<char>(value >> 8 * i & 0xFF));
    return result;
}

std::string glb_chunk(std::uint32_t id, const std::string& content) {
    return little_endian(id, 2) + little_endian(static_cast<std::uint32_t>(content.size()) + 6, 4) + content;
}

// A 3DS file of one square of two faces; its first point has `first` as x, its last face the point `last`.
std::string square_3ds(float first = 0.0f, std::uint32_t last = 3) {
    std::string points = little_endian(4, 2);
    for (const float value : {first, 0.f, 0.f, 1000.f, 0.f, 0.f, 1000.f, 1000.f, 0.f, 0.f, 1000.f, 0.f}) {
        std::uint32_t bits;
        std::memcpy(&bits, &value, 4);
        points += little_endian(bits, 4);
    }
    std::string faces = little_endian(2, 2);
    for (const std::uint32_t point : {0u, 1u, 2u, 0u, 0u, 2u, last, 0u}) faces += little_endian(point, 2);
    return glb_chunk(0x4D4D, glb_chunk(0x3D3D, glb_chunk(0x4000, std::string("o\0", 2) +
                                                                     glb_chunk(0x4100, glb_chunk(0x4110, points) +
                                                                                           glb_chunk(0x4120, faces)))));
}

std::string object(const std::string& file) {
    return "<SceneObject name='" + file + "'><Geometries><Geometry3D fileName='" + file +
           "'/></Geometries></SceneObject>";
}

TEST(ImportModels, FacesOf3dsThatAreLostAreCounted) {
    std::string short_header = square_3ds();
    short_header.replace(2, 4, little_endian(5, 4));
    const auto scene = imported(show_mvr(
        object("good.3ds") + object("nan.3ds") + object("face.3ds") + object("empty.3ds") + object("short.3ds"),
        {{"good.3ds", square_3ds()},
         {"nan.3ds", square_3ds(NAN)},
         {"face.3ds", square_3ds(0.0f, 999)},
         {"empty.3ds", glb_chunk(0x4D4D, "")},
         {"short.3ds", short_header}}));
    EXPECT_EQ(scene->instances.size(), 2u) << "good, and what is left of face";
    EXPECT_TRUE(says(*scene,
                     "left out: faces of a 3DS model with points that are not finite, or beyond 1e9: \"nan.3ds (2 of "
                     "2)\""));
    EXPECT_TRUE(says(*scene, "left out: faces of a 3DS model with points that do not exist: \"face.3ds (1 of 2)\""));
    EXPECT_TRUE(says(*scene, "left out: a model has no faces: \"nan.3ds\", \"empty.3ds\", \"short.3ds\""));
    EXPECT_TRUE(says(*scene, "left out: bytes behind the main chunk of a 3DS model: \"short.3ds (" +
                                 std::to_string(short_header.size() - 6) + ")\""));
    EXPECT_FALSE(says(*scene, "good.3ds ("));
}

TEST(ImportModels, FacesOfBodiesToo) {
    const auto shown = [](const std::string& model, const std::string& file) {
        const std::string text = gdtf_text(
            {.geometries = "<Geometry Name='Base' Model='M'><Beam Name='Lens' LuminousFlux='1000'/></Geometry>",
             .modes = mode_text("Base", ""),
             .models = "<Model Name='M' Length='1' Width='1' Height='1' File='b' " + model + "/>"});
        const std::string gdtf =
            *write_zip(std::vector<ZipFile>{{"description.xml", text}, {"models/3ds/b.3ds", file}});
        return imported(show_mvr(fixture("Spot", kHanging), {{"Maker@Head.gdtf", gdtf}}));
    };
    const std::string broken = little_endian(0x4D4D, 2) + little_endian(5, 4) + "xxxxx";
    const auto nan = shown("", square_3ds(NAN));
    EXPECT_TRUE(says(*nan, "not finite, or beyond 1e9: \"Type: models/3ds/b.3ds (2 of 2)\""));
    EXPECT_TRUE(says(*nan, "left out: a model has no faces: \"Type: models/3ds/b.3ds\""));
    EXPECT_TRUE(says(*nan, "left out: a model of a fixture is not drawn: \"Type: M\""));
    const auto cube = shown("PrimitiveType='Cube'", broken);
    EXPECT_TRUE(says(*cube, "left out: a model has no faces: \"Type: models/3ds/b.3ds\""));
    ASSERT_TRUE(cube->bodies);
    EXPECT_EQ(cube->bodies->parts.size(), 1u) << "the primitive stands for it";
    const auto good = shown("PrimitiveType='Cube'", square_3ds());
    EXPECT_FALSE(says(*good, "models/3ds/b.3ds"));
}

TEST(ImportModels, AModelThatIsTooLargeIsLeftOutByName) {
    const std::string huge =
        R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
        R"("meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"buffers":[{"byteLength":36}],)"
        R"("bufferViews":[{"buffer":0,"byteLength":36}],)"
        R"("accessors":[{"bufferView":0,"componentType":5126,"count":2147483648,"type":"VEC3"}]})";
    const auto scene =
        imported(show_mvr(object("b.glb") + object("good.3ds"), {{"b.glb", huge}, {"good.3ds", square_3ds()}}));
    EXPECT_EQ(scene->instances.size(), 1u);
    EXPECT_TRUE(says(*scene, "left out: a model cannot be read: too_large: \"b.glb ("));
    EXPECT_TRUE(says(*scene, "/accessors/0/count: 2147483648"));
}

}  // namespace
}  // namespace gonio
