// glTF import: extensions that say where meshes stand and what surfaces are; the table of what is made of each.
#include <gtest/gtest.h>
#include <webp/encode.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <set>
#include <sstream>

#include "server/assets/gltf_features.h"
#include "server/scene/apply.h"
#include "server/scene/limits.h"
#include "server/scene/scene.h"
#include "server/trace/reference.h"
#include "tests/unit/assets_gltf_fixture.h"

namespace gonio {
namespace {

class AssetsExtensions : public GltfFixture {
protected:
    void refused(const Json& document, const std::string& code, const std::string& where, const std::string& value) {
        const auto result = load(document);
        ASSERT_FALSE(result) << code << " at " << where;
        EXPECT_EQ(result.error().code, code) << result.error().text();
        EXPECT_EQ(result.error().where, where) << result.error().text();
        EXPECT_EQ(result.error().value, value) << result.error().text();
    }
};

TEST(GltfFeatures, ThePageIsTheTable) {
    std::ostringstream page;
    page << std::ifstream(std::string(GONIO_SOURCE_DIR) + "/docs/gltf.md").rdbuf();
    EXPECT_EQ(page.str(), gltf_features_text()) << "goniod --print-gltf > docs/gltf.md";
    std::set<std::string_view> names;
    for (const GltfFeature& row : kGltfCore) names.insert(row.name);
    for (const GltfFeature& row : kGltfExtensions) names.insert(row.name);
    EXPECT_EQ(names.size(), kGltfCore.size() + kGltfExtensions.size());
}

// A file that says it uses an extension is told what was made of it; one that requires it loads unless it is refused.
TEST_F(AssetsExtensions, EachIsWhatTheTableSays) {
    for (const GltfFeature& row : kGltfExtensions) {
        SCOPED_TRACE(row.name);
        Json document = triangle();
        document["extensionsUsed"] = {row.name};
        const auto scene = good(document);
        const bool where_used = row.name == "KHR_materials_transmission" || row.name == "KHR_materials_unlit" ||
                                row.name == "KHR_texture_basisu" || row.name == "EXT_texture_avif" ||
                                row.name == "MSFT_texture_dds";
        const std::string said = feature_warning(row);
        EXPECT_EQ(said.ends_with("; changes lux"), row.changes_lux);
        EXPECT_EQ(warns(*scene, said), row.state != FeatureState::supported && !where_used);
        document["extensionsRequired"] = {row.name};
        if (row.state == FeatureState::refused)
            refused(document, "unsupported", "/extensionsRequired/0", std::string(row.name));
        else
            good(document);
    }
}

// Materials of extensions that nobody knows yet leave shapes as they are: a file may require them.
TEST_F(AssetsExtensions, MaterialsThatAreNotKnown) {
    Json document = triangle();
    document["extensionsRequired"] = {"VENDOR_materials_velvet"};
    document["materials"] = {{{"pbrMetallicRoughness", {{"baseColorFactor", {0.25, 0.5, 0.75, 1.0}}}},
                              {"extensions", {{"VENDOR_materials_velvet", {{"pile", 3}}}}}}};
    document["meshes"][0]["primitives"][0]["material"] = 0;
    const auto scene = good(document);
    EXPECT_TRUE(warns(*scene, "VENDOR_materials_velvet is not known and was ignored; perhaps it changes lux"));
    EXPECT_NEAR(scene->materials.at(0).base_color.g, 0.5, 1e-6);
    document["extensionsRequired"] = {"VENDOR_mesh_of_materials"};
    refused(document, "unsupported", "/extensionsRequired/0", "VENDOR_mesh_of_materials");
}

// The bytes of a lossless WebP picture, RGBA.
std::string webp(int width_px, int height_px, const std::vector<std::uint8_t>& rgba) {
    std::uint8_t* bytes = nullptr;
    const std::size_t size = WebPEncodeLosslessRGBA(rgba.data(), width_px, height_px, 4 * width_px, &bytes);
    std::string result(reinterpret_cast<const char*>(bytes), size);
    WebPFree(bytes);
    return result;
}

// Colours stay straight under low alpha, where a premultiplied byte would have lost them.
TEST_F(AssetsExtensions, WebpComesBeforePng) {
    const std::vector<std::uint8_t> rgba = {200, 100, 50, 128, 0, 0, 240, 255, 10, 20, 30, 3, 240, 17, 1, 64};
    write("t.webp", webp(2, 2, rgba));
    write("t.png", *encode_png({1, 1, {1, 2, 3}}));
    Json document = textured("t.png");
    document["images"].push_back({{"uri", "t.webp"}});
    document["extensionsUsed"] = {"EXT_texture_webp"};
    document["textures"][0]["extensions"]["EXT_texture_webp"]["source"] = 1;
    const auto scene = good(document);
    ASSERT_EQ(scene->images.size(), 1u);
    EXPECT_EQ(scene->images[0].rgba, rgba);
    document["textures"][0].erase("source");
    EXPECT_EQ(good(document)->images.at(0).rgba, rgba);
    document["textures"][0]["extensions"]["EXT_texture_webp"]["source"] = 2;
    EXPECT_TRUE(warns(*good(document), "a texture without an image was left out; changes lux (/textures/0)"));
}

TEST_F(AssetsExtensions, DamagedWebpIsLeftOut) {
    const std::string whole = webp(9, 7, std::vector<std::uint8_t>(9 * 7 * 4, 77));
    const Json document = textured("t.webp");
    write("t.webp", whole);
    EXPECT_EQ(good(document)->images.at(0).height_px, 7);
    for (std::size_t size = 12; size < whole.size(); ++size) {
        write("t.webp", whole.substr(0, size));
        const auto scene = good(document);
        EXPECT_TRUE(scene->images.empty());
        EXPECT_TRUE(warns(*scene, "changes lux (/images/0/uri: t.webp)"));
    }
}

// Headers of a few bytes that speak of 65,535 x 65,535 pixels (WebP: 16,384): 16 GiB that nobody allocates.
TEST_F(AssetsExtensions, HeadersOfGreatImages) {
    const auto data = [](const std::string& bytes) {
        return textured("data:application/octet-stream;base64," + base64(bytes));
    };
    // SOI; a frame header of 8 bit, 65500 x 65500, the most that libjpeg takes, 3 components; tables and scan are
    // missing.
    std::string jpeg("\xff\xd8\xff\xc0\x00\x11\x08\xff\xdc\xff\xdc\x03\x01\x11\x00\x02\x11\x01\x03\x11\x01", 21);
    jpeg += std::string("\xff\xda\x00\x0c\x03\x01\x00\x02\x11\x03\x11\x00\x3f\x00\x00", 15);
    for (const char frame : {'\xc0', '\xc2'}) {  // sequential, progressive
        jpeg[3] = frame;
        refused(data(jpeg), "too_large", "/images/0/uri", "65500x65500");
    }
    const std::string png(
        "\x89PNG\r\n\x1a\n\x00\x00\x00\x0dIHDR\x00\x00\xff\xff\x00\x00\xff\xff\x08\x06\x00\x00\x00"
        "\xb6\x05\xd9\x50\x00\x00\x00\x00IDAT\x35\xaf\x06\x1e",
        45);
    refused(data(png), "too_large", "/images/0/uri", "65535x65535");
    // VP8L: 14 bits of width - 1, 14 of height - 1.
    const std::string vp8l("RIFF\x12\x00\x00\x00WEBPVP8L\x05\x00\x00\x00\x2f\xff\xff\xff\x0f\x00", 26);
    refused(data(vp8l), "too_large", "/images/0/uri", "16384x16384");
}

TEST_F(AssetsExtensions, TexturesOfFormatsThatAreNotRead) {
    write("t.png", *encode_png({1, 1, {1, 2, 3}}));
    for (const char* const extension : {"KHR_texture_basisu", "EXT_texture_avif", "MSFT_texture_dds"}) {
        SCOPED_TRACE(extension);
        Json document = textured("t.png");
        document["images"].push_back({{"uri", "there-is-no-such-file.ktx2"}});
        document["extensionsUsed"] = document["extensionsRequired"] = {extension};
        document["textures"][0]["extensions"][extension]["source"] = 1;
        auto scene = good(document);
        EXPECT_EQ(scene->images.size(), 1u);
        EXPECT_FALSE(warns(*scene, extension));
        document["textures"][0].erase("source");
        scene = good(document);
        EXPECT_TRUE(scene->images.empty());
        EXPECT_TRUE(warns(*scene, std::string(extension) + ": the texture is left out; changes lux (/textures/0)"));
    }
}

// An unlit square of 2 x 2 m, a metre over a point that it is turned to.
Json unlit_square() {
    Json document = with_positions({-1, 1, -1, 1, 1, -1, -1, 1, 1, 1, 1, 1});
    document["meshes"][0]["primitives"][0]["mode"] = 5;
    document["meshes"][0]["primitives"][0]["material"] = 0;
    document["materials"] = Json::parse(R"([{"emissiveFactor": [9, 9, 9], "extensions": {"KHR_materials_unlit": {}},
        "pbrMetallicRoughness": {"baseColorFactor": [1, 0.5, 0.25, 1]}}])");
    document["extensionsUsed"] = document["extensionsRequired"] = {"KHR_materials_unlit"};
    return document;
}

TEST_F(AssetsExtensions, UnlitReflectsOrEmits) {
    const std::string path = write("unlit.gltf", unlit_square().dump());
    const auto albedo = load_scene(path), emission = load_scene(path, "", {.unlit = Unlit::emission});
    ASSERT_TRUE(albedo && emission);
    EXPECT_TRUE(warns(**albedo, "reflectance (--unlit albedo); changes lux"));
    EXPECT_TRUE(warns(**emission, "emitted, 80 cd/m² at white (--unlit emission); changes lux"));
    EXPECT_EQ((*albedo)->materials[0].base_color, glm::vec4(0.95f, 0.5f, 0.25f, 1.0f));
    EXPECT_EQ((*albedo)->materials[0].emissive_nit, glm::vec3(0));
    EXPECT_EQ((*emission)->materials[0].base_color, glm::vec4(0, 0, 0, 1));
    // E = pi L F, of a point under the middle of a square: F = 4/pi · sin·atan(sin), sin = 1/sqrt(2) for a half-side
    // as long as the distance.
    const double sine = std::sqrt(0.5), per_nit = 4.0 * sine * std::atan(sine);
    const trace::MeterPoint points[] = {{{0, 0, 0}, {0, 1, 0}}};
    trace::Settings settings;
    settings.bounces = 0;
    settings.noise = 0.002;
    const auto lit = trace::measure(*trace::make_world(scene_of(*emission)), points, settings).front();
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(lit.direct_lx[c], per_nit * 80.0 / (1 << c), 0.01 * per_nit * 80.0);
    EXPECT_EQ(trace::measure(*trace::make_world(scene_of(*albedo)), points, settings).front().direct_lx.g, 0.0);
}

TEST_F(AssetsExtensions, UnlitTexturesKeepTheirAlpha) {
    write("t.webp", webp(1, 1, {200, 100, 50, 128}));
    Json document = textured("t.webp");
    document["materials"][0]["extensions"]["KHR_materials_unlit"] = Json::object();
    const auto with_alpha = [&](const char* mode) {
        document["materials"][0]["alphaMode"] = mode;
        return *load_scene(write("unlit.gltf", document.dump()), "", {.unlit = Unlit::emission});
    };
    auto scene = with_alpha("OPAQUE");
    EXPECT_EQ(scene->materials[0].emissive_image, 0);
    EXPECT_EQ(scene->materials[0].base_color_image, -1);
    scene = with_alpha("MASK");
    EXPECT_EQ(scene->materials[0].emissive_image, 0);
    EXPECT_EQ(scene->materials[0].base_color_image, 0);
}

TEST_F(AssetsExtensions, SpecularGlossinessIsItsDiffusePart) {
    write("t.png", *encode_png({1, 1, {1, 2, 3}}));
    Json document = textured("t.png");
    document["materials"][0] = Json::parse(R"({"pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1]}, "extensions":
        {"KHR_materials_pbrSpecularGlossiness": {"diffuseFactor": [0.2, 0.4, 0.6, 0.8], "diffuseTexture": {"index": 0,
        "extensions": {"KHR_texture_transform": {"offset": [0.5, 0.25], "scale": [2, 3]}}}}}})");
    document["extensionsUsed"] = document["extensionsRequired"] = {"KHR_materials_pbrSpecularGlossiness"};
    const auto scene = good(document);
    EXPECT_EQ(scene->materials[0].base_color, glm::vec4(0.2f, 0.4f, 0.6f, 0.8f));
    EXPECT_EQ(scene->materials[0].base_color_image, 0);
    EXPECT_EQ(scene->meshes.at(0).vertices.at(1).uv, glm::vec2(2.5f, 0.25f));
    EXPECT_TRUE(warns(*scene, "KHR_materials_pbrSpecularGlossiness: "));
}

Json instanced() {
    Json document = triangle();
    const int moves = add_accessor(document, bytes_of({1, 2, 3, -4, 0, 0}), 5126, 2, "VEC3");
    // A quarter turn about +Z and none, as normalised shorts.
    const std::string turns("\0\0\0\0\x82\x5a\x82\x5a\0\0\0\0\0\0\xff\x7f", 16);
    const int rotations = add_accessor(document, turns, 5122, 2, "VEC4", true);
    const int scales = add_accessor(document, bytes_of({2, 2, 2, 1, -1, 1}), 5126, 2, "VEC3");
    document["nodes"][0]["translation"] = {10, 0, 0};
    document["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
        {"TRANSLATION", moves}, {"ROTATION", rotations}, {"SCALE", scales}};
    document["extensionsUsed"] = document["extensionsRequired"] = {"EXT_mesh_gpu_instancing"};
    return document;
}

TEST_F(AssetsExtensions, GpuInstances) {
    const auto scene = good(instanced());
    ASSERT_EQ(scene->instances.size(), 2u);
    const auto corner = [&](std::size_t instance, const glm::dvec3& point) {
        return glm::dvec3(scene->instances[instance].world_from_mesh * glm::dvec4(point, 1));
    };
    // Scaled by 2, turned from +X to +Y, moved; then the node's own move.
    EXPECT_LT(glm::length(corner(0, {1, 0, 0}) - glm::dvec3(11, 4, 3)), 1e-6);
    EXPECT_LT(glm::length(corner(0, {0, 1, 0}) - glm::dvec3(9, 2, 3)), 1e-6);
    EXPECT_LT(glm::length(corner(1, {0, 1, 0}) - glm::dvec3(6, -1, 0)), 1e-6);
    // The mirrored one has its front where the plain one has it.
    EXPECT_NE(scene->instances[0].mesh, scene->instances[1].mesh);
    EXPECT_FALSE(warns(*scene, "EXT_mesh_gpu_instancing"));
}

TEST_F(AssetsExtensions, GpuInstanceRefusals) {
    const std::string place = "/nodes/0/extensions/EXT_mesh_gpu_instancing/attributes";
    Json document = instanced();
    Json& attributes = document["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
    attributes["SCALE"] = 0;  // the triangle's three positions
    refused(document, "bad_gltf", place + "/SCALE", "3");
    attributes["SCALE"] = 9;
    refused(document, "out_of_bounds", place + "/SCALE", "9");
    attributes.erase("SCALE");
    attributes["ROTATION"] = 0;
    refused(document, "bad_gltf", place + "/ROTATION", "0");
    attributes["ROTATION"] = add_accessor(document, std::string(32, '\0'), 5126, 2, "VEC4");
    const auto turnless = good(document);
    EXPECT_TRUE(turnless->instances.empty());
    EXPECT_TRUE(warns(*turnless,
                      "2 instances whose place is no numbers, or whose rotation has no length, left out; "
                      "changes lux (" +
                          place + ")"));
    attributes["ROTATION"] = add_accessor(document, bytes_of({0, 0, 0, 1, std::nanf(""), 0, 0, 1}), 5126, 2, "VEC4");
    EXPECT_EQ(good(document)->instances.size(), 1u);
    attributes.erase("ROTATION");
    document["accessors"].push_back({{"componentType", 5126}, {"count", 2000000000}, {"type", "VEC3"}});
    attributes["TRANSLATION"] = document["accessors"].size() - 1;
    refused(document, "too_large", place + "/TRANSLATION", "2000000000");
    // A million at one node, and again at another.
    document["accessors"].back()["count"] = kMaxLights * 900;
    document["meshes"][0]["primitives"][0]["mode"] = 1;  // lines: nothing is shown at any place
    EXPECT_TRUE(load(document));
    document["nodes"].push_back(document["nodes"][0]);
    document["scenes"][0]["nodes"].push_back(1);
    refused(document, "too_large", "/nodes/1/extensions/EXT_mesh_gpu_instancing/attributes/TRANSLATION",
            std::to_string(kMaxLights * 900));
}

TEST_F(AssetsExtensions, ARootThatIsAChildIsShownOnce) {
    Json document = triangle();
    document["nodes"] = Json::parse(R"([{"translation": [1, 0, 0], "children": [1]}, {"mesh": 0}])");
    const std::string words = "root nodes that are children: ";
    const struct {
        const char* roots;
        std::size_t instances;
        double x;
        bool warns;
    } cases[] = {{"[0]", 1, 1, false},
                 {"[0, 1]", 1, 1, true},
                 {"[1, 0]", 1, 1, true},
                 {"[0, 0]", 1, 1, true},
                 {"[1]", 1, 0, true}};
    for (const auto& c : cases) {
        SCOPED_TRACE(c.roots);
        document["scenes"][0]["nodes"] = Json::parse(c.roots);
        const auto scene = good(document);
        ASSERT_EQ(scene->instances.size(), c.instances);
        EXPECT_EQ(scene->instances[0].world_from_mesh[3].x, c.x);
        EXPECT_EQ(warns(*scene, words), c.warns);
    }
}

}  // namespace
}  // namespace gonio
