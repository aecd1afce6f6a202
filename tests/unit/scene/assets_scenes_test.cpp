// Built-in scenes, profiles and picture files.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <tuple>

#include "ies/synthetic.h"
#include "server/assets/assets.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

void expect_sane(const SceneAsset& scene) {
    ASSERT_FALSE(scene.materials.empty());
    for (const Mesh& mesh : scene.meshes) {
        ASSERT_LT(static_cast<std::size_t>(mesh.material), scene.materials.size());
        std::size_t against = 0;
        for (const Vertex& vertex : mesh.vertices) {
            ASSERT_TRUE(std::isfinite(vertex.position.x + vertex.position.y + vertex.position.z));
            ASSERT_NEAR(glm::length(vertex.normal), 1.0f, 1e-5f);
        }
        for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
            const Vertex &a = mesh.vertices.at(mesh.indices[i]), &b = mesh.vertices.at(mesh.indices[i + 1]),
                         &c = mesh.vertices.at(mesh.indices[i + 2]);
            const glm::vec3 face = glm::cross(b.position - a.position, c.position - a.position);
            against += glm::dot(face, a.normal + b.normal + c.normal) <= 0.0f;
        }
        EXPECT_EQ(against, 0u) << "triangles whose winding contradicts their normals, of " << mesh.indices.size() / 3;
    }
    for (const Image& image : scene.images) {
        EXPECT_LE(std::max(image.width_px, image.height_px), 1024);
        EXPECT_EQ(image.rgba.size(),
                  static_cast<std::size_t>(image.width_px) * static_cast<std::size_t>(image.height_px) * 4);
    }
    for (const Material& material : scene.materials) {
        for (int c = 0; c < 3; ++c) EXPECT_LE(material.base_color[c], 1.0f);
        EXPECT_LT(material.base_color_image, static_cast<int>(scene.images.size()));
    }
    ASSERT_EQ(scene.lights.size(), 1u);
    ASSERT_NE(scene.lights[0].profile, nullptr);
    EXPECT_GT(scene.lights[0].profile->flux_lm, 100.0);
    const glm::dvec3 aim = scene.lights[0].world_from_light * glm::dvec3(0, 0, -1);
    EXPECT_NEAR(aim.y, -1.0, 1e-12);
    EXPECT_NEAR((scene.lights[0].world_from_light * glm::dvec3(1, 0, 0)).x, 1.0, 1e-12);
    EXPECT_EQ(scene.cameras.size(), 1u);
    EXPECT_TRUE(scene.warnings.empty());
}

void expect_equal(const SceneAsset& a, const SceneAsset& b) {
    ASSERT_EQ(a.meshes.size(), b.meshes.size());
    for (std::size_t i = 0; i < a.meshes.size(); ++i) {
        EXPECT_EQ(a.meshes[i].indices, b.meshes[i].indices);
        ASSERT_EQ(a.meshes[i].vertices.size(), b.meshes[i].vertices.size());
        EXPECT_EQ(std::memcmp(a.meshes[i].vertices.data(), b.meshes[i].vertices.data(),
                              a.meshes[i].vertices.size() * sizeof(Vertex)),
                  0);
    }
    for (std::size_t i = 0; i < a.images.size(); ++i) EXPECT_EQ(a.images[i].rgba, b.images[i].rgba);
}

TEST(AssetsScenes, Cornell) {
    const auto scene = load_scene("cornell");
    ASSERT_TRUE(scene);
    EXPECT_EQ((*scene)->triangles(), 33480u);  // the seed paper's figure
    expect_sane(**scene);
    expect_equal(**scene, *make_cornell());
    EXPECT_EQ((*scene)->bounds.min, glm::dvec3(-2, 0, -2));
    EXPECT_EQ((*scene)->bounds.max, glm::dvec3(2, 4, 2));
}

// Every edge of the sculpture is shared by two triangles that run along it in opposite directions.
TEST(AssetsScenes, SculptureIsClosed) {
    const auto scene = make_cornell();
    const Mesh* sculpture = nullptr;
    for (const Mesh& mesh : scene->meshes) {
        if (mesh.indices.size() > 30000) sculpture = &mesh;
    }
    ASSERT_NE(sculpture, nullptr);
    std::map<std::array<float, 6>, int> edges;
    double volume = 0.0;
    for (std::size_t i = 0; i < sculpture->indices.size(); i += 3) {
        glm::vec3 p[3];
        for (std::size_t k = 0; k < 3; ++k) p[k] = sculpture->vertices[sculpture->indices[i + k]].position;
        for (std::size_t k = 0; k < 3; ++k) {
            const glm::vec3 a = p[k], b = p[(k + 1) % 3];
            ++edges[{a.x, a.y, a.z, b.x, b.y, b.z}];
        }
        volume += glm::dot(glm::dvec3(p[0]), glm::cross(glm::dvec3(p[1]), glm::dvec3(p[2]))) / 6.0;
    }
    for (const auto& [edge, count] : edges) {
        ASSERT_EQ(count, 1);
        ASSERT_EQ(edges.count({edge[3], edge[4], edge[5], edge[0], edge[1], edge[2]}), 1u);
    }
    EXPECT_GT(volume, 0.05);  // m³, positive: the front is outside
}

TEST(AssetsScenes, Atrium) {
    const auto scene = load_scene("atrium");
    ASSERT_TRUE(scene);
    EXPECT_GE((*scene)->triangles(), 262267u);  // the seed paper's figure
    EXPECT_LE((*scene)->triangles(), 350000u);
    std::size_t stored = 0;
    for (const Mesh& mesh : (*scene)->meshes) stored += mesh.indices.size() / 3;
    EXPECT_LT(stored * 10, (*scene)->triangles());  // instanced
    expect_sane(**scene);
    expect_equal(**scene, *make_atrium());
    for (const Instance& instance : (*scene)->instances) {
        EXPECT_GT(glm::determinant(glm::dmat3(instance.world_from_mesh)), 0.0) << instance.node;
    }
    EXPECT_EQ((*scene)->bounds.min, glm::dvec3(-12, 0, -6));
    EXPECT_EQ((*scene)->bounds.max, glm::dvec3(12, 10, 6));
}

TEST(AssetsProfiles, BuiltinOnesHaveTheirFlux) {
    for (const auto& luminaire : ies::synthetic_luminaires()) {
        const auto profile = builtin_profile(std::string(luminaire.name));
        ASSERT_TRUE(profile) << luminaire.name;
        EXPECT_EQ((*profile)->name, luminaire.name);
        EXPECT_NEAR((*profile)->flux_lm / luminaire.flux.in(lm), 1.0, 0.002) << luminaire.name;
        EXPECT_GT((*profile)->peak_cd, 0.0);
    }
    const auto none = builtin_profile("candle");
    ASSERT_FALSE(none);
    EXPECT_EQ(none.error().code, "not_found");
    EXPECT_EQ(none.error().value, "candle");
    EXPECT_FALSE(make_profile("x", "no photometry"));
}

TEST(AssetsProfiles, SpotCones) {
    for (const auto& [inner, outer] :
         {std::pair(0.0, 0.7), std::pair(0.7, 0.7), std::pair(0.9, 0.3), std::pair(0.0, 0.0), std::pair(0.0, 1e-4),
          std::pair(1.0, 9.0), std::pair(0.6999, 0.7)}) {
        const auto profile = punctual_spot_profile(inner, outer);
        const auto& web = profile->photometry.web;
        for (std::size_t i = 0; i + 1 < web.v_rad.size(); ++i)
            ASSERT_LT(web.v_rad[i], web.v_rad[i + 1]) << inner << outer;
        ASSERT_EQ(web.candela.size(), web.v_rad.size() * web.h_rad.size());
        for (const float value : web.candela) ASSERT_TRUE(value >= 0.0f && value <= 1.0f);
        EXPECT_LE(profile->peak_cd, 1.0);
    }
    EXPECT_EQ(punctual_spot_profile(0.1, 0.7)->peak_cd, 1.0);
}

class AssetsPictures : public ::testing::Test {
protected:
    template <typename T>
    std::string file(const std::string& name, const T& bytes) {
        const std::string path =
            (std::filesystem::temp_directory_path() / ("gonio-picture-" + std::to_string(getpid()) + name)).string();
        std::ofstream(path, std::ios::binary)
            .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
        paths_.insert(path);
        return path;
    }
    void TearDown() override {
        for (const std::string& path : paths_) std::filesystem::remove(path);
    }
    std::set<std::string> paths_;
};

TEST_F(AssetsPictures, ExrIsExact) {
    for (const int channels : {1, 3}) {
        FloatPicture picture{5, 3, channels, {}};
        for (int i = 0; i < 15 * channels; ++i)
            picture.values.push_back(std::ldexp(1.0f + 0.1f * static_cast<float>(i), i - 10));
        picture.values[0] = 0.0f;
        picture.values[1] = 1e-38f;
        picture.values[2] = 3e38f;
        const auto bytes = encode_exr(picture, channels == 1 ? "lx" : "cd/m2");
        ASSERT_TRUE(bytes) << bytes.error().text();
        const std::string text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
        EXPECT_NE(text.find("gonio:unit"), std::string::npos);
        EXPECT_NE(text.find(channels == 1 ? "lx" : "cd/m2"), std::string::npos);
        const auto read = read_picture(file(".exr", *bytes));
        ASSERT_TRUE(read) << read.error().text();
        EXPECT_EQ(read->width_px, 5);
        EXPECT_EQ(read->height_px, 3);
        EXPECT_EQ(read->channels, channels);
        EXPECT_EQ(read->values, picture.values);
    }
}

TEST_F(AssetsPictures, PngIsExactAndJpegIsClose) {
    BytePicture picture{16, 8, {}};
    for (int i = 0; i < 16 * 8; ++i)
        picture.rgb.insert(picture.rgb.end(), {static_cast<std::uint8_t>(i), 100, static_cast<std::uint8_t>(200 - i)});
    const auto png = encode_png(picture), jpeg = encode_jpeg(picture, 95);
    ASSERT_TRUE(png && jpeg);
    const auto exact = read_picture(file(".png", *png)), close = read_picture(file(".jpg", *jpeg));
    ASSERT_TRUE(exact && close);
    for (std::size_t i = 0; i < picture.rgb.size(); ++i) {
        EXPECT_EQ(std::lround(exact->values[i] * 255.0f), picture.rgb[i]);
        EXPECT_NEAR(close->values[i] * 255.0f, picture.rgb[i], 12.0f);
    }
}

TEST_F(AssetsPictures, WrongSizesAndFilesAreRefused) {
    EXPECT_FALSE(encode_png({4, 4, {1, 2, 3}}));
    EXPECT_FALSE(encode_exr({2, 2, 2, {1, 2, 3, 4, 5, 6, 7, 8}}, "lx"));
    EXPECT_FALSE(encode_exr({0, 0, 3, {}}, "lx"));
    const auto missing = read_picture("/nonexistent.png");
    ASSERT_FALSE(missing);
    EXPECT_EQ(missing.error().code, "bad_image");
    EXPECT_FALSE(read_picture(file("x.png", std::string("no picture"))));
}

}  // namespace
}  // namespace gonio
