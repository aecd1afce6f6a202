// 3DS models: made here chunk by chunk, and the primitives of GDTF, whose sizes and counts were read with another tool.
#include "server/exchange/mesh_3ds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "tests/fuzz/damaged.h"
#include "tests/shared_data.h"
#include "tests/unit/scene/exchange_test_support.h"

namespace gonio {
namespace {

std::string u16(unsigned value) {
    return {static_cast<char>(value & 0xFF), static_cast<char>(value >> 8)};
}
std::string floats(std::initializer_list<float> values) {
    std::string bytes;
    for (const float value : values) {
        char four[4];
        std::memcpy(four, &value, 4);  // little-endian, as the machines that are tested on
        bytes.append(four, 4);
    }
    return bytes;
}
std::string chunk(unsigned id, const std::string& content) {
    const std::size_t length = content.size() + 6;
    return u16(id) + u16(length & 0xFFFF) + u16(static_cast<unsigned>(length >> 16)) + content;
}
std::string face(unsigned a, unsigned b, unsigned c) {
    return u16(a) + u16(b) + u16(c) + u16(0);
}
std::string file_of(const std::string& materials, const std::string& points, const std::string& faces,
                    const std::string& more = "") {
    return chunk(0x4D4D, chunk(0x0002, u16(3) + u16(0)) +
                             chunk(0x3D3D, materials + chunk(0x4000, std::string("object\0", 7) +
                                                                         chunk(0x4100, chunk(0x4110, points) + more +
                                                                                           chunk(0x4120, faces)))));
}

const std::string kSquare = u16(4) + floats({0, 0, 0, 2, 0, 0, 2, 1, 0, 0, 1, 0.5f});
const std::string kMaterial = chunk(
    0xAFFF, chunk(0xA000, std::string("red\0", 4)) + chunk(0xA020, chunk(0x0011, std::string("\xFF\x80\x00", 3))));

TEST(Mesh3ds, TrianglesAndTheirColours) {
    const std::string of_material = chunk(0x4130, std::string("red\0", 4) + u16(1) + u16(1));
    const auto mesh =
        exchange::read_3ds(file_of(kMaterial, kSquare, u16(2) + face(0, 1, 2) + face(0, 2, 3) + of_material));
    ASSERT_TRUE(mesh) << mesh.error().text();
    EXPECT_EQ(mesh->triangles(), 2u);
    ASSERT_EQ(mesh->parts.size(), 2u);
    EXPECT_EQ(mesh->parts[0].material, -1);
    EXPECT_EQ(mesh->parts[1].material, 0);
    EXPECT_EQ(mesh->parts[1].positions[1], glm::vec3(2, 1, 0));
    EXPECT_EQ(mesh->materials.at(0).name, "red");
    EXPECT_NEAR(mesh->materials[0].color.r, 1.0, 1e-6);
    EXPECT_NEAR(mesh->materials[0].color.g, 0.2159, 1e-4) << "sRGB 128";
    EXPECT_EQ(mesh->least, glm::dvec3(0, 0, 0));
    EXPECT_EQ(mesh->most, glm::dvec3(2, 1, 0.5));
}

TEST(Mesh3ds, MatricesAndKeyframesAreNotApplied) {
    const std::string matrix = chunk(0x4160, floats({0, 1, 0, -1, 0, 0, 0, 0, 1, 100, 200, 300}));
    const auto mesh = exchange::read_3ds(file_of("", kSquare, u16(1) + face(0, 1, 2), matrix));
    ASSERT_TRUE(mesh);
    EXPECT_EQ(mesh->most, glm::dvec3(2, 1, 0));
}

TEST(Mesh3ds, WhatIsNoTriangleIsLeftOut) {
    const std::string points = u16(5) + floats({0, 0, 0, 2, 0, 0, 2, 1, 0, 4, 0, 0, NAN, 0, 0});
    const auto mesh =
        exchange::read_3ds(file_of("", points, u16(4) + face(0, 1, 2) + face(0, 1, 3) + face(0, 1, 4) + face(0, 1, 9)));
    ASSERT_TRUE(mesh);
    EXPECT_EQ(mesh->triangles(), 1u) << "in line, not a number, no such vertex";
    EXPECT_EQ(mesh->left_out.no_area, 1u);
    EXPECT_EQ(mesh->left_out.not_finite, 1u);
    EXPECT_EQ(mesh->left_out.no_point, 1u);
    EXPECT_EQ(mesh->faces(), 4u);
    EXPECT_EQ(mesh->bytes_behind, 0u);
}

TEST(Mesh3ds, AMainChunkThatIsTooShortHoldsNoFaces) {
    std::string whole = file_of("", kSquare, u16(1) + face(0, 1, 2));
    whole.replace(2, 4, u16(5) + u16(0));  // less than its own six bytes
    const auto mesh = exchange::read_3ds(whole);
    ASSERT_TRUE(mesh) << mesh.error().text();
    EXPECT_EQ(mesh->faces(), 0u);
    EXPECT_EQ(mesh->bytes_behind, whole.size() - 6);
    const auto empty = exchange::read_3ds(chunk(0x4D4D, ""));
    ASSERT_TRUE(empty);
    EXPECT_EQ(empty->faces(), 0u);
    EXPECT_EQ(empty->bytes_behind, 0u);
}

TEST(Mesh3ds, WhatIsLongerThanItsPlaceIsRefused) {
    const std::string whole = file_of(kMaterial, kSquare, u16(1) + face(0, 1, 2));
    for (const std::string& bytes :
         {std::string(), std::string("MM"), std::string("glTF...."), file_of("", u16(5) + floats({0, 0, 0}), u16(0)),
          file_of("", kSquare, u16(9) + face(0, 1, 2)),
          chunk(0x4D4D, u16(0x3D3D) + u16(0xFFFF) + u16(0xFFFF) + "abcd")}) {
        const auto mesh = exchange::read_3ds(bytes);
        ASSERT_FALSE(mesh);
        EXPECT_EQ(mesh.error().code, "bad_3ds");
    }
    for (std::size_t length = 0; length < whole.size(); ++length) {
        const auto mesh = exchange::read_3ds(whole.substr(0, length));
        if (!mesh) {
            EXPECT_EQ(mesh.error().code, "bad_3ds");
        }
    }
}

TEST(Mesh3ds, ModelsAreScaledAlongEachAxis) {
    const glm::dvec3 scale = exchange::model_scale({-100, -1, 0}, {100, 1, 0}, {0.5, 0.25, 0.1}, 0.001);
    EXPECT_DOUBLE_EQ(scale.x, 0.0025);
    EXPECT_DOUBLE_EQ(scale.y, 0.125);
    EXPECT_DOUBLE_EQ(scale.z, 0.001) << "it has no height";
    EXPECT_DOUBLE_EQ(exchange::model_scale({0, 0, 0}, {10, 10, 10}, {0, 1, 1}, 0.001).x, 0.001);
}

TEST(Mesh3ds, Primitives) {
    const auto folder = test::shared_data("formats");
    if (!folder) GTEST_SKIP() << "the samples are not on this machine";
    struct Row {
        const char* name;
        std::size_t faces;
        glm::dvec3 size;
    };
    for (const Row& row : {Row{"1.0/primitivetype_base.3ds", 76, {1.08947, 1.00532, 0.99518}},
                           Row{"1.0/primitivetype_yoke.3ds", 68, {1.0, 1.0, 1.0}},
                           Row{"1.0/primitivetype_head.3ds", 80, {0.99640, 1.00385, 0.99200}},
                           Row{"1.0/primitivetype_scanner.3ds", 182, {1.0, 1.0, 1.0}},
                           Row{"1.0/primitivetype_conventional.3ds", 234, {1.0, 1.60633, 1.02782}},
                           Row{"1.1/primitivetype_base_1.1.3ds", 76, {1.08947, 1.00532, 0.99518}},
                           Row{"1.1/primitivetype_scanner_1.1.3ds", 258, {0.43033, 1.1, 0.43363}},
                           Row{"1.1/primitivetype_conventional_1.1.3ds", 234, {1.0, 1.0, 1.67976}}}) {
        const auto mesh = exchange::read_3ds(test::bytes_of(*folder / "gdtf-primitives" / "meshes" / row.name));
        ASSERT_TRUE(mesh) << row.name << ": " << mesh.error().text();
        EXPECT_LE(mesh->triangles(), row.faces) << row.name;
        EXPECT_GE(mesh->triangles(), row.faces - 4) << row.name << ": few have no area";
        const glm::dvec3 size = mesh->most - mesh->least;
        for (int i = 0; i < 3; ++i) EXPECT_NEAR(size[i], row.size[i], 1e-4) << row.name << " " << i;
        EXPECT_FALSE(mesh->materials.empty());
        EXPECT_EQ(mesh->faces(), row.faces) << row.name;
        EXPECT_EQ(mesh->left_out.no_point + mesh->left_out.not_finite + mesh->bytes_behind, 0u) << row.name;
    }
}

TEST(Mesh3ds, DamagedFilesAreRefusedOrRead) {
    const std::string whole = file_of(kMaterial, kSquare, u16(2) + face(0, 1, 2) + face(0, 2, 3));
    std::mt19937 random(5);
    std::size_t read = 0, refused = 0;
    for (int i = 0; i < 20000; ++i) {
        const auto mesh = exchange::read_3ds(fuzz::damaged(whole, 1 + static_cast<unsigned>(i) % 4, random));
        mesh ? ++read : ++refused;
        if (mesh) {
            EXPECT_LE(mesh->triangles(), 8u);
        }
    }
    EXPECT_GT(read, 1000u);
    EXPECT_GT(refused, 1000u);
}

}  // namespace
}  // namespace gonio
