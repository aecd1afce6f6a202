// glTF import: one fault of a file does not refuse the whole. The rest loads, and one warning names the place and says
// whether lux change.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "ies/core/decomposed_text.h"
#include "ies/synthetic.h"
#include "server/assets/assets.h"
#include "server/scene/scene.h"
#include "tests/shared_data.h"
#include "tests/unit/assets_gltf_fixture.h"

namespace gonio {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();

// Two triangles of a square of 1 m, normals along Z; vertex 4 is in none.
Json square() {
    Json document = with_positions({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 5, 5, 5});
    const std::string indices("\x00\x01\x02\x00\x02\x03", 6);
    Json& primitive = document["meshes"][0]["primitives"][0];
    primitive["indices"] = add_accessor(document, indices, 5121, 6, "SCALAR");
    primitive["material"] = 0;
    document["materials"] = Json::parse(R"([{"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1]}}])");
    return document;
}

// Of `components` numbers a vertex, all `usual` but one.
std::vector<float> with_one(std::size_t components, float usual, std::size_t at, float odd) {
    std::vector<float> values(5 * components, usual);
    values[at] = odd;
    return values;
}

class AssetsFaults : public GltfFixture {
protected:
    // The scene loads with its triangles and this one warning; "" for none.
    std::shared_ptr<const SceneAsset> loads(const Json& document, const std::string& said, std::size_t triangles = 2) {
        const auto scene = good(document);
        EXPECT_EQ(scene->triangles(), triangles);
        EXPECT_EQ(scene->warnings, said.empty() ? std::vector<std::string>() : std::vector<std::string>{said});
        return scene;
    }
    // The square with a picture as its base colour.
    Json pictured(const Json& image) {
        Json document = square();
        document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 0;
        document["textures"] = Json::parse(R"([{"source": 0}])");
        document["images"] = Json::array({image});
        add_attribute(document, "TEXCOORD_0", std::vector<float>(10, 0.25f), "VEC2");
        return document;
    }
    static void add_attribute(Json& document, const char* name, const std::vector<float>& values, const char* shape) {
        document["meshes"][0]["primitives"][0]["attributes"][name] =
            add_accessor(document, bytes_of(values), 5126, 5, shape);
    }
};

TEST_F(AssetsFaults, ImagesThatCannotBeRead) {
    write("cut.png", std::string("\x89PNG\r\n\x1a\n", 8));
    write("a.ktx2", std::string("\xabKTX 20\xbb\r\n\x1a\n", 12));
    const std::pair<Json, const char*> cases[] = {
        {{{"uri", "gone.png"}}, "an image was left out, the file is missing; changes lux (/images/0/uri: gone.png)"},
        {{{"uri", "a.ktx2"}},
         "an image was left out, the image is neither PNG nor JPEG nor WebP; changes lux (/images/0/uri: a.ktx2)"},
        {{{"uri", "data:image/ktx2;base64,q0tUWA=="}},
         "an image was left out, the image is neither PNG nor JPEG nor WebP; changes lux (/images/0/uri)"},
        {{{"uri", "data:image/png;base64,A*AA"}},
         "an image was left out, a data URI whose base64 is malformed; changes lux (/images/0/uri)"},
        {{{"uri", "http://example.org/a.png"}},
         "an image was left out, only data: URIs and relative file references are read; changes lux (/images/0/uri: "
         "http://example.org/a.png)"},
        {{{"uri", "../a.png"}},
         "an image was left out, the URI leaves the directory of the glTF file; changes lux (/images/0/uri: ../a.png)"},
        {{{"name", "nothing"}}, "an image was left out, an image without uri and bufferView; changes lux (/images/0)"},
        {{{"bufferView", 99}}, "an image was left out, an image without uri and bufferView; changes lux (/images/0)"},
        {{{"bufferView", 0}},
         "an image was left out, the image is neither PNG nor JPEG nor WebP; changes lux (/images/0/bufferView)"},
    };
    for (const auto& [image, said] : cases) {
        SCOPED_TRACE(image.dump());
        const auto scene = loads(pictured(image), said);
        EXPECT_EQ(scene->materials.at(0).base_color_image, -1);
        EXPECT_EQ(scene->materials.at(0).base_color, glm::vec4(0.5f, 0.5f, 0.5f, 1.0f)) << "the factor stays";
    }
    const auto damaged = good(pictured({{"uri", "cut.png"}}));
    ASSERT_EQ(damaged->warnings.size(), 1u);
    EXPECT_NE(damaged->warnings[0].find("changes lux (/images/0/uri: cut.png)"), std::string::npos);
}

// An image that two textures share is told of once; a normal map that cannot be read leaves the colour.
TEST_F(AssetsFaults, ImagesThatCannotBeReadAreToldOfOnce) {
    Json document = pictured({{"uri", "gone.png"}});
    document["textures"].push_back({{"source", 0}});
    document["materials"][0]["emissiveTexture"]["index"] = 1;
    document["materials"][0]["normalTexture"]["index"] = 1;
    loads(document, "an image was left out, the file is missing; changes lux (/images/0/uri: gone.png)");
    write("t.png", *encode_png({1, 1, {100, 100, 100}}));
    document = pictured({{"uri", "t.png"}});
    document["images"].push_back({{"uri", "normals.ktx2"}});
    document["textures"].push_back({{"source", 1}});
    document["materials"][0]["normalTexture"]["index"] = 1;
    const auto scene =
        loads(document, "an image was left out, the file is missing; changes lux (/images/1/uri: normals.ktx2)");
    EXPECT_EQ(scene->materials.at(0).base_color_image, 0);
    EXPECT_EQ(scene->materials.at(0).normal_image, -1);
}

// A PNG of 8192 x 8192 grey pixels that ends with its header. Four take all texels of a scene.
TEST_F(AssetsFaults, ImagesThatCannotBeReadCountByTheirHeader) {
    const char cut[] =
        "\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\x20\0\0\0\x20\0\x08\0\0\0\0"
        "\x57\xc1\x95\x85"
        "\0\0\x10\0IDAT\x78\x9c";
    write("cut.png", std::string(cut, sizeof cut - 1));
    Json document = pictured({{"uri", "cut.png"}});
    for (int i = 1; i < 5; ++i) {
        document["images"].push_back({{"uri", "cut.png"}});
        document["textures"].push_back({{"source", i}});
        document["materials"].push_back(document["materials"][0]);
        document["materials"].back()["pbrMetallicRoughness"]["baseColorTexture"]["index"] = i;
    }
    const auto scene = load(document);
    ASSERT_FALSE(scene);
    EXPECT_EQ(scene.error().code, "too_large") << scene.error().text();
}

TEST_F(AssetsFaults, ManyFaultsSayOnceWhetherLuxChange) {
    Json document = square();
    for (int i = 0; i < 500; ++i) document["materials"].push_back({{"occlusionTexture", {{"index", 7}}}});
    EXPECT_EQ(good(document)->warnings.back(), "more warnings were left out");
    document["materials"].push_back({{"emissiveTexture", {{"index", 7}}}});
    const auto scene = good(document);
    ASSERT_EQ(scene->warnings.size(), 100u);
    EXPECT_EQ(scene->warnings.back(), "more warnings were left out; changes lux");
}

TEST_F(AssetsFaults, TexturesThatNameNothing) {
    Json document = square();
    document["textures"] = Json::parse(R"([{"source": 0, "sampler": 3}])");
    auto scene = good(document);
    EXPECT_EQ(scene->triangles(), 2u);
    EXPECT_EQ(scene->warnings,
              (std::vector<std::string>{"a texture that nothing uses has no image (/textures/0/source: 0)",
                                        "a texture that nothing uses has no sampler (/textures/0/sampler: 3)"}));
    write("t.png", *encode_png({1, 1, {100, 100, 100}}));
    document = pictured({{"uri", "t.png"}});
    document["textures"][0]["sampler"] = 3;
    loads(document, "a texture whose sampler is not there repeats; changes lux (/textures/0/sampler: 3)");
    document["textures"][0] = {{"source", -1}};
    loads(document, "a texture without an image was left out; changes lux (/textures/0)");
    document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 7;
    document["textures"][0]["source"] = 0;
    loads(document,
          "a material's texture that is not there was left out; changes lux "
          "(/materials/0/pbrMetallicRoughness/baseColorTexture/index: 7)");
    document = pictured({{"uri", "t.png"}});
    document["materials"][0]["occlusionTexture"]["index"] = 7;
    loads(document, "a material's texture that is not there was left out (/materials/0/occlusionTexture/index: 7)");
    document["materials"][0].erase("occlusionTexture");
    document["samplers"] = Json::parse(R"([{"wrapS": 5}])");
    document["textures"][0]["sampler"] = 0;
    loads(document, "there is no such wrap mode: the texture repeats; changes lux (/samplers/0/wrapS: 5)");
}

TEST_F(AssetsFaults, LuminairesWithoutTheirPhotometricFileAreThereAndDark) {
    write("bad.ies", std::string("IESNA:LM-63-2002\n[TEST] no tilt line\n"));
    write("good.ies", ies::synthetic_lm63("bulb"));
    Json document = square();
    document["extensions"]["EXT_lights_ies"]["lights"] = {
        {{"uri", "gone.ies"}}, {{"uri", "bad.ies"}}, {{"name", "empty"}}, {{"uri", "good.ies"}}};
    for (int i = 0; i < 7; ++i) {
        document["nodes"].push_back(
            {{"name", "lamp"}, {"extensions", {{"EXT_lights_ies", {{"light", std::max(0, i - 3)}}}}}});
        document["scenes"][0]["nodes"].push_back(i + 1);
    }
    document["extensionsUsed"] = {"EXT_lights_ies"};
    document["nodes"][1]["extensions"]["EXT_lights_ies"]["multiplier"] = 0.5;
    const auto scene = good(document);
    ASSERT_EQ(scene->lights.size(), 7u);
    EXPECT_EQ(scene->triangles(), 2u);
    EXPECT_TRUE(warns(*scene,
                      "luminaires are dark: \"lamp\", \"lamp 2\", \"lamp 3\" and 1 more, because the file is missing; "
                      "changes lux (/extensions/EXT_lights_ies/lights/0/uri: gone.ies)"));
    EXPECT_TRUE(warns(*scene, "a luminaire is dark: \"lamp 5\", because the photometric file is refused"));
    EXPECT_TRUE(warns(*scene, "changes lux (/extensions/EXT_lights_ies/lights/1/uri: bad.ies)"));
    EXPECT_TRUE(warns(*scene,
                      "a luminaire is dark: \"lamp 6\", because a light without uri and bufferView; changes lux "
                      "(/extensions/EXT_lights_ies/lights/2)"));
    EXPECT_EQ(scene->warnings.size(), 3u);
    for (std::size_t i = 0; i < 6; ++i) {
        const Profile& profile = *scene->lights[i].profile;
        EXPECT_EQ(profile.peak_cd, 0.0);
        EXPECT_EQ(profile.flux_lm, 0.0);
        ASSERT_EQ(profile.photometry.diagnostics.size(), 1u) << "it is marked";
    }
    EXPECT_EQ(scene->lights[0].profile->name, "gone.ies") << "a file of this name may come later";
    EXPECT_EQ(scene->lights[0].profile->photometry.diagnostics[0].code, "missing_file");
    EXPECT_EQ(scene->lights[0].multiplier, 0.5) << "what the next profile is times";
    EXPECT_GT(scene->lights[6].profile->flux_lm, 0.0);
}

TEST_F(AssetsFaults, NormalsThatAreNoNumbersAreRebuilt) {
    for (const float odd : {kNaN, kInfinity, -kInfinity}) {
        Json document = square();
        std::vector<float> normals = with_one(3, 0.0f, 3, odd);
        for (std::size_t i = 2; i < normals.size(); i += 3) normals[i] = 1.0f;
        add_attribute(document, "NORMAL", normals, "VEC3");
        const char* const said =
            "normals that are no numbers were rebuilt from the faces; changes lux (/meshes/0/primitives/0)";
        const auto scene = loads(document, said);
        for (const Vertex& vertex : scene->meshes.at(0).vertices) EXPECT_EQ(vertex.normal, glm::vec3(0, 0, 1));
        const int still = add_accessor(document, bytes_of(std::vector<float>(15, 0.0f)), 5126, 5, "VEC3");
        document["meshes"][0]["primitives"][0]["targets"] = Json::array({Json{{"POSITION", still}}});
        document["meshes"][0]["weights"] = {1};
        loads(document, said);               // of a morphed mesh too
        std::swap(normals[3], normals[12]);  // of the vertex that is in no triangle
        document.erase("accessors");
        document = square();
        add_attribute(document, "NORMAL", normals, "VEC3");
        loads(document, "");
    }
}

TEST_F(AssetsFaults, PositionsThatAreNoNumbersTakeTheirTrianglesAlone) {
    for (const float odd : {kNaN, kInfinity}) {
        const auto with = [&](std::size_t at) {
            std::vector<float> positions = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 5, 5, 5};
            positions[at] = odd;
            Json document = square();
            const int view = add_view(document, bytes_of(positions));
            document["accessors"][0]["bufferView"] = view;
            return document;
        };
        const auto scene = loads(with(4),
                                 "1 triangle whose positions are no numbers left out; changes lux "
                                 "(/meshes/0/primitives/0)",
                                 1);
        EXPECT_EQ(scene->bounds.max, glm::dvec3(1, 1, 0));
        loads(with(14), "");  // nothing uses the last
        const auto none = good(with(2));
        EXPECT_EQ(none->triangles(), 0u);
        EXPECT_TRUE(warns(*none, "2 triangles whose positions are no numbers left out; changes lux"));
    }
}

TEST_F(AssetsFaults, OtherValuesThatAreNoNumbers) {
    write("t.png", *encode_png({1, 1, {100, 100, 100}}));
    for (const float odd : {kNaN, kInfinity}) {
        for (const bool used : {true, false}) {
            SCOPED_TRACE(used);
            const std::size_t vertex = used ? 1 : 4;
            Json document = square();
            add_attribute(document, "COLOR_0", with_one(3, 0.5f, 3 * vertex, odd), "VEC3");
            const auto coloured =
                loads(document,
                      used ? "vertex colours that are no numbers are white; changes lux (/meshes/0/primitives/0)" : "");
            bool white = false;
            for (const glm::u16vec4& color : coloured->meshes.at(0).colors) white |= color.r == 65535;
            EXPECT_EQ(white, used);
            document = pictured({{"uri", "t.png"}});
            add_attribute(document, "TEXCOORD_0", with_one(2, 0.25f, 2 * vertex, odd), "VEC2");
            const auto mapped = loads(
                document,
                used ? "texture coordinates that are no numbers are 0; changes lux (/meshes/0/primitives/0)" : "");
            for (const Vertex& one : mapped->meshes.at(0).vertices) EXPECT_TRUE(std::isfinite(one.uv.x + one.uv.y));
            document = square();
            add_attribute(document, "TEXCOORD_1", with_one(2, 0.25f, 2 * vertex, odd), "VEC2");
            loads(document,
                  used ? "texture coordinates TEXCOORD_1 that are no numbers are 0 (/meshes/0/primitives/0)" : "");
            document = pictured({{"uri", "t.png"}});
            document["materials"][0]["normalTexture"]["index"] = 0;
            std::vector<float> normals(15, 0.0f);
            for (std::size_t i = 2; i < 15; i += 3) normals[i] = 1.0f;
            add_attribute(document, "NORMAL", normals, "VEC3");
            add_attribute(document, "TANGENT", with_one(4, 1.0f, 4 * vertex, odd), "VEC4");
            const auto bumpy = good(document);
            EXPECT_EQ(warns(*bumpy,
                            "tangents that are no numbers were rebuilt from the texture coordinates; changes lux "
                            "(/meshes/0/primitives/0)"),
                      used);
            EXPECT_EQ(bumpy->warnings.size(), used ? 2u : 1u) << "beside that of normal textures";
            for (const glm::vec4& tangent : bumpy->meshes.at(0).tangents) EXPECT_TRUE(std::isfinite(tangent.x));
        }
    }
}

// RFC 8259, 6: JSON has one kind of number.
TEST_F(AssetsFaults, IntegersWrittenAsFloats) {
    Json document = square();
    std::string text = document.dump();
    const auto replace = [&](const std::string& from, const std::string& to) {
        const std::size_t at = text.find(from);
        ASSERT_NE(at, std::string::npos) << from;
        text.replace(at, from.size(), to);
    };
    replace(R"("mesh":0)", R"("mesh":0.0)");
    replace(R"("POSITION":0)", R"("POSITION":0e0)");
    replace(R"("indices":1)", R"("indices":10e-1)");
    replace(R"("count":5)", R"("count":5.0)");
    replace(R"("version":"2.0")", R"("version":2.0)");
    const auto scene = load_scene(write("floats.gltf", text));
    ASSERT_TRUE(scene) << scene.error().text();
    EXPECT_EQ((*scene)->triangles(), 2u);
    EXPECT_TRUE((*scene)->warnings.empty()) << "it is understood";
    document["asset"] = Json::parse(R"({"version": "2", "minVersion": "2"})");
    loads(document, "");
}

TEST_F(AssetsFaults, BinaryChunksWithoutPadding) {
    Json document = triangle();
    document["buffers"][0].erase("uri");
    const std::string bytes = bytes_of({0, 0, 0, 1, 0, 0, 0, 1, 0});
    for (std::size_t spaces = 0; spaces < 4; ++spaces) {
        const std::string json = document.dump() + std::string(spaces, ' ');
        const auto file = [&](const std::string& padding, std::size_t length) {
            const std::string chunks = little_endian(json.size()) + "JSON" + json + padding +
                                       little_endian(bytes.size()) + std::string("BIN\0", 4) + bytes;
            return "glTF" + little_endian(2) + little_endian(length > 0 ? length : 12 + chunks.size()) + chunks;
        };
        const auto tight = load_scene(write("tight.glb", file("", 0)));
        ASSERT_TRUE(tight) << tight.error().text();
        EXPECT_EQ((*tight)->triangles(), 1u);
        const auto padded = load_scene(write("padded.glb", file(std::string((4 - json.size() % 4) % 4, ' '), 0)));
        ASSERT_TRUE(padded) << padded.error().text();
        EXPECT_EQ((*padded)->triangles(), 1u);
        const std::string whole = file("", 0);
        EXPECT_FALSE(load_scene(write("cut.glb", whole.substr(0, whole.size() - 1))));
    }
}

TEST_F(AssetsFaults, SchemesInCapitals) {
    Json document = square();
    std::string uri = document["buffers"][0]["uri"];
    uri.replace(0, uri.find(','), "DATA:application/octet-stream;BASE64");
    document["buffers"][0]["uri"] = uri;
    loads(document, "");
}

// "grün" in one character a letter, as most systems write it, and in two, as macOS and some archives do.
TEST_F(AssetsFaults, NamesWhoseAccentsAreSpeltOtherwise) {
    const std::string composed = "gr\xc3\xbcn", decomposed = "gru\xcc\x88n";
    EXPECT_EQ(decomposed_text(composed), decomposed);
    EXPECT_EQ(decomposed_text(decomposed), decomposed);
    EXPECT_EQ(decomposed_text("\xe1\xba\xa5"), "a\xcc\x82\xcc\x81");                     // two accents
    EXPECT_EQ(decomposed_text("\xed\x95\x9c"), "\xe1\x84\x92\xe1\x85\xa1\xe1\x86\xab");  // Korean
    EXPECT_EQ(decomposed_text("\xff\xe2\x82 plain"), "\xff\xe2\x82 plain");              // no UTF-8
    const auto png = encode_png({1, 1, {100, 100, 100}});
    ASSERT_TRUE(png);
    for (const auto& [on_disk, in_file] : {std::pair(composed, decomposed), std::pair(decomposed, composed)}) {
        std::filesystem::create_directory(directory_ / on_disk);
        write(on_disk + "/" + on_disk + ".png", *png);
        const auto scene = loads(pictured({{"uri", in_file + "/" + in_file + ".png"}}), "");
        EXPECT_EQ(scene->images.size(), 1u);
        ASSERT_NE(scene->files, nullptr);
        EXPECT_EQ(scene->files->files.size(), 2u) << "followers need it too";
        std::filesystem::remove_all(directory_ / on_disk);
    }
    std::filesystem::create_symlink(directory_.parent_path(), directory_ / composed);
    write("../a.png", *png);
    EXPECT_TRUE(warns(*good(pictured({{"uri", decomposed + "/a.png"}})), "the URI leaves the directory"));
}

// The folders' READMEs say what is right.
TEST(AssetsSharedCases, LoadDespiteOneFault) {
    const auto folder = test::shared_data("cases");
    if (!folder) GTEST_SKIP() << "no shared cases on this machine";
    const std::pair<const char*, const char*> cases[] = {
        {"public/draco-more-vertices/bowlingPin.glb",
         "it has 78 vertices for 77, 64 triangles for 64 (/meshes/0/primitives/0"},
        {"public/draco-more-vertices/brick.glb", "larger than its accessors say"},
        {"public/nan-normal.gltf", "normals that are no numbers were rebuilt"},
        {"public/unused-texture-without-image.gltf", "a texture that nothing uses has no image"},
        {"public/unaligned-json-chunk.glb", ""},
        {"public/meshopt-no-fallback/meshopt-no-fallback.gltf", ""},
        {"public/integer_written_as_float.gltf", ""},
        {"public/ktx2-normal-texture.gltf", "changes lux (/images/0/uri)"},
        {"24-glb-framing/bom.gltf", ""},
        {"24-glb-framing/nulpad.glb", ""},
        {"24-glb-framing/numver.gltf", ""},
        {"24-glb-framing/shortlength.glb", ""},
        {"24-glb-framing/thirdchunk.glb", ""},
        {"24-glb-framing/trailing.glb", ""},
        {"23-uri-kinds/case.gltf", "(/images/0/uri: tex/My%20Picture.PNG)"},
        {"23-uri-kinds/missing.gltf", "(/images/0/uri: tex/none.png)"},
        {"23-uri-kinds/parent.gltf", "the URI leaves the directory"},
    };
    for (const auto& [name, said] : cases) {
        SCOPED_TRACE(name);
        const auto scene = load_scene(*folder / name);
        ASSERT_TRUE(scene) << scene.error().text();
        EXPECT_GT((*scene)->triangles() + (std::string(name).find("integer") != std::string::npos), 0u);
        std::string all;
        for (const std::string& warning : (*scene)->warnings) all += warning + "\n";
        EXPECT_NE(all.find(said), std::string::npos) << all;
    }
    for (const auto& entry : std::filesystem::directory_iterator(*folder / "23-uri-kinds")) {
        if (entry.path().extension() != ".gltf") continue;
        const auto scene = load_scene(entry.path());
        EXPECT_TRUE(scene) << entry.path() << scene.error().text();
    }
    for (const char* name : {"24-glb-framing/truncated.glb", "24-glb-framing/gltf1.gltf", "24-glb-framing/v21.gltf"})
        EXPECT_FALSE(load_scene(*folder / name)) << name;
}

}  // namespace
}  // namespace gonio
