// glTF import: each feature of the contract on a document of a few lines, built here.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "ies/synthetic.h"
#include "protocol/schema/command.pb.h"
#include "server/assets/assets.h"
#include "server/scene/apply.h"
#include "server/scene/limits.h"
#include "server/scene/scene.h"
#include "tests/shared_data.h"
#include "tests/unit/angles.h"
#include "tests/unit/assets_gltf_fixture.h"

namespace gonio {
namespace {

class AssetsGltf : public GltfFixture {};

TEST_F(AssetsGltf, TriangleLoads) {
    const auto scene = good(triangle());
    ASSERT_EQ(scene->triangles(), 1u);
    const Mesh& mesh = scene->meshes.at(0);
    ASSERT_EQ(mesh.vertices.size(), 3u);
    // Normals are missing: flat, and on the side from which the triangle runs counter-clockwise.
    for (const Vertex& vertex : mesh.vertices) EXPECT_EQ(vertex.normal, glm::vec3(0, 0, 1));
    EXPECT_EQ(scene->bounds.max, glm::dvec3(1, 1, 0));
    EXPECT_GE(scene->materials.size(), 1u);
    // It has no material: glTF's default is white, and reflects all light.
    EXPECT_EQ(scene->materials.at(static_cast<std::size_t>(mesh.material)).base_color,
              glm::vec4(0.95f, 0.95f, 0.95f, 1.0f));
    ASSERT_EQ(scene->warnings.size(), 1u);
    EXPECT_NE(scene->warnings[0].find("--max-albedo"), std::string::npos);
}

TEST_F(AssetsGltf, ReflectancesAreBounded) {
    Json document = triangle();
    document["materials"] = Json::parse(R"([{"pbrMetallicRoughness": {"baseColorFactor": [1, 0.3, 0.9, 0.99]}},
        {"pbrMetallicRoughness": {"baseColorFactor": [0.9, 0.3, 0.2, 1]}}])");
    document["meshes"][0]["primitives"][0]["material"] = 0;
    const std::string path = write("white.gltf", document.dump());
    const auto usual = load_scene(path), dark = load_scene(path, "", {.max_albedo = 0.5});
    ASSERT_TRUE(usual && dark);
    EXPECT_EQ((*usual)->materials[0].base_color, glm::vec4(0.95f, 0.3f, 0.9f, 0.99f));
    EXPECT_EQ((*usual)->warnings.size(), 1u);
    EXPECT_EQ((*dark)->materials[0].base_color, glm::vec4(0.5f, 0.3f, 0.5f, 0.99f));
    document["meshes"][0]["primitives"][0]["material"] = 1;
    const auto grey = load_scene(write("grey.gltf", document.dump()));
    ASSERT_TRUE(grey);
    EXPECT_TRUE((*grey)->warnings.empty()) << "what no mesh shows is not worth a word";
    write("white.png", *encode_png({1, 1, {255, 255, 255}}));
    document = textured("white.png");
    document["materials"].push_back(document["materials"][0]);  // no mesh shows it
    document["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = {0.5, 0.5, 0.5, 1};
    EXPECT_EQ(good(document)->images.at(0).rgba.at(0), 255) << "its factor does not count";
}

TEST_F(AssetsGltf, NodesMultiplyInDouble) {
    Json document = triangle();
    document["nodes"] = Json::parse(R"([
        {"translation": [10000000.25, 0, 0], "children": [1]},
        {"rotation": [0, 0, 0.70710678118654752, 0.70710678118654752], "scale": [2, 2, 2], "children": [2]},
        {"matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 0.5,0,0,1], "mesh": 0}])");
    const auto scene = good(document);
    const glm::dvec3 corner(scene->instances.at(0).world_from_mesh * glm::dvec4(1, 0, 0, 1));
    // Shifted by whole kilometres after they were multiplied: single precision has steps of 1 m there.
    EXPECT_TRUE(warns(*scene, "relative to 10000000, 0, 0 m:"));
    EXPECT_NEAR(corner.x, 0.25, 1e-8);
    EXPECT_NEAR(corner.y, 3.0, 1e-12);
}

TEST_F(AssetsGltf, MirroredInstanceKeepsItsFront) {
    Json document = triangle();
    document["nodes"][0]["scale"] = {-1, 1, 1};
    const auto scene = good(document);
    const Instance& instance = scene->instances.at(0);
    const Mesh& mesh = scene->meshes.at(static_cast<std::size_t>(instance.mesh));
    glm::dvec3 p[3];
    for (int k = 0; k < 3; ++k) {
        const Vertex& vertex = mesh.vertices[mesh.indices[static_cast<std::size_t>(k)]];
        p[k] = glm::dvec3(instance.world_from_mesh * glm::dvec4(vertex.position, 1));
        EXPECT_EQ(vertex.normal, glm::vec3(0, 0, -1));  // cofactors turn it round: Materials.AMirroredSquare…
    }
    EXPECT_GT(glm::cross(p[1] - p[0], p[2] - p[0]).z, 0.0);
}

TEST_F(AssetsGltf, StripsFansAndPlainArrays) {
    // Four corners of a square, in strip order and in fan order.
    Json document = with_positions({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0});
    document["meshes"][0]["primitives"][0]["mode"] = 5;
    auto scene = good(document);
    EXPECT_EQ(scene->triangles(), 2u);
    for (const Vertex& vertex : scene->meshes[0].vertices) EXPECT_EQ(vertex.normal, glm::vec3(0, 0, 1));
    document = with_positions({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0});
    document["meshes"][0]["primitives"][0]["mode"] = 6;
    scene = good(document);
    EXPECT_EQ(scene->triangles(), 2u);
    for (const Vertex& vertex : scene->meshes[0].vertices) EXPECT_EQ(vertex.normal, glm::vec3(0, 0, 1));
    document["meshes"][0]["primitives"][0]["mode"] = 1;
    scene = good(document);
    EXPECT_EQ(scene->triangles(), 0u);
    EXPECT_TRUE(warns(*scene, "points and lines"));
}

TEST_F(AssetsGltf, IndexTypes) {
    for (const auto& [type, bytes] : {std::pair(5121, 1), std::pair(5123, 2), std::pair(5125, 4)}) {
        Json document = triangle();
        std::string indices;
        for (const int index : {0, 1, 2})
            indices +=
                std::string(1, static_cast<char>(index)) + std::string(static_cast<std::size_t>(bytes) - 1, '\0');
        add_accessor(document, indices, type, 3, "SCALAR");
        document["meshes"][0]["primitives"][0]["indices"] = 1;
        EXPECT_EQ(good(document)->triangles(), 1u) << type;
    }
}

TEST_F(AssetsGltf, NormalisedAndIntegerAttributes) {
    Json document = with_positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
    const std::string uv("\x00\x00\xff\x00\x00\xff", 6);  // bytes: (0,0) (1,0) (0,1)
    add_accessor(document, uv, 5121, 3, "VEC2", true);
    document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = 1;
    std::string normals;  // KHR_mesh_quantization: signed bytes, 127 = 1
    for (int i = 0; i < 3; ++i) normals += std::string("\x00\x00\x7f", 3);
    add_accessor(document, normals, 5120, 3, "VEC3", true);
    document["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = 2;
    document["extensionsRequired"] = document["extensionsUsed"] = {"KHR_mesh_quantization"};
    const auto scene = good(document);
    EXPECT_EQ(scene->meshes[0].vertices[1].uv, glm::vec2(1, 0));
    EXPECT_EQ(scene->meshes[0].vertices[2].uv, glm::vec2(0, 1));
    EXPECT_EQ(scene->meshes[0].vertices[0].normal, glm::vec3(0, 0, 1));
}

TEST_F(AssetsGltf, SparseAccessor) {
    Json document = triangle();
    add_accessor(document, std::string("\x02\x00", 2), 5123, 1, "SCALAR");  // brings the view of the indices
    add_accessor(document, bytes_of({0, 5, 0}), 5126, 1, "VEC3");
    document["accessors"][0]["sparse"] = {
        {"count", 1}, {"indices", {{"bufferView", 1}, {"componentType", 5123}}}, {"values", {{"bufferView", 2}}}};
    EXPECT_EQ(good(document)->bounds.max.y, 5.0);
    document["accessors"][0].erase("bufferView");  // all zero but for the sparse element: no area
    EXPECT_EQ(good(document)->triangles(), 0u);
}

TEST_F(AssetsGltf, Materials) {
    Json document = triangle();
    document["materials"] = Json::parse(R"([{"name": "lamp", "doubleSided": true, "alphaMode": "MASK",
        "alphaCutoff": 0.25, "emissiveFactor": [1, 0.5, 0],
        "pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 0.4]},
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 300}}}])");
    document["extensionsUsed"] = {"KHR_materials_emissive_strength"};
    document["meshes"][0]["primitives"][0]["material"] = 0;
    const auto scene = good(document);
    const Material& material = scene->materials.at(static_cast<std::size_t>(scene->meshes[0].material));
    EXPECT_EQ(material.name, "lamp");
    EXPECT_EQ(material.base_color, glm::vec4(0.1f, 0.2f, 0.3f, 0.4f));
    EXPECT_EQ(material.emissive_nit, glm::vec3(300, 150, 0));
    EXPECT_TRUE(material.alpha_mask && material.double_sided);
    EXPECT_EQ(material.alpha_cutoff, 0.25f);
    EXPECT_TRUE(scene->warnings.empty());
    document["materials"][0]["alphaMode"] = "BLEND";
    const auto blended = good(document);
    EXPECT_TRUE(blended->materials[0].alpha_blend && !blended->materials[0].alpha_mask);
    document["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = {0.1, 0.2, 0.3, 1.0};  // covers all
    EXPECT_FALSE(good(document)->materials[0].alpha_blend);
}

// 1 x 1 and 2 x 1 PNG files: straight alpha, 16 bit, grey with alpha, palette.
TEST_F(AssetsGltf, ImagesBecomeRgba8) {
    const std::pair<const char*, std::vector<int>> cases[] = {
        {"iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR4nGM4kWLUAAAFNQHfc2Lj2wAAAABJRU5ErkJggg==",
         {200, 100, 50, 128}},
        {"iVBORw0KGgoAAAANSUhEUgAAAAEAAAABEAAAAABq7kcWAAAAC0lEQVR4nGNoaAAAAYMBARg1IhUAAAAASUVORK5CYII=",
         {128, 128, 128, 255}},
        {"iVBORw0KGgoAAAANSUhEUgAAAAEAAAABEAQAAADljNBBAAAADUlEQVR4nGNwcDhwAAAEBQIBctEHsQAAAABJRU5ErkJggg==",
         {64, 64, 64, 192}},
        {"iVBORw0KGgoAAAANSUhEUgAAAAIAAAABCAMAAADD/I+4AAAABlBMVEX/AAAAAP9sof2OAAAAC0lEQVR4nGNgYAQAAAQAAr96P0oAAAAASUVO"
         "RK5CYII=",
         {255, 0, 0, 255, 0, 0, 255, 255}},
    };
    for (const auto& [png, rgba] : cases) {
        const auto scene = good(textured("data:image/png;base64," + std::string(png)));
        ASSERT_EQ(scene->images.size(), 1u);
        ASSERT_EQ(scene->images[0].rgba.size(), rgba.size());
        // 249 is the last that reflects no more than 0.95.
        for (std::size_t i = 0; i < rgba.size(); ++i)
            EXPECT_EQ(scene->images[0].rgba[i], i % 4 == 3 ? rgba[i] : std::min(rgba[i], 249)) << i;
    }
}

TEST_F(AssetsGltf, ImageFilesBesideTheDocument) {
    BytePicture picture{2, 1, {255, 0, 0, 0, 0, 255}};
    const auto png = encode_png(picture), jpeg = encode_jpeg(picture, 95);
    ASSERT_TRUE(png && jpeg);
    write("a b.png", *png);
    write("c%20d.png", *png);
    std::filesystem::create_directory(directory_ / "sub");
    write("sub/e.jpg", *jpeg);
    for (const char* uri : {"a%20b.png", "a b.png", "c%20d.png", "sub/e.jpg", "./sub/../a b.png"}) {
        const auto scene = good(textured(uri));
        ASSERT_EQ(scene->images.size(), 1u) << uri;
        EXPECT_EQ(scene->images[0].width_px, 2) << uri;
    }
}

TEST_F(AssetsGltf, WrapModesAndTextureTransform) {
    write("t.png", *encode_png({1, 1, {1, 2, 3}}));
    Json document = textured("t.png");
    document["samplers"] = Json::parse(R"([{"wrapS": 33071, "wrapT": 10497}])");
    document["textures"][0]["sampler"] = 0;
    document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"]["KHR_texture_transform"] =
        Json::parse(R"({"offset": [0.5, 0.25], "scale": [2, 3], "rotation": 1.5707963267948966})");
    document["extensionsUsed"] = {"KHR_texture_transform"};
    const auto scene = good(document);
    EXPECT_EQ(scene->materials[0].wrap_s, Wrap::clamp);
    EXPECT_EQ(scene->materials[0].wrap_t, Wrap::repeat);
    // (1, 0) is scaled to (2, 0), turned counter-clockwise in a picture whose v points down to (0, -2), then moved.
    EXPECT_NEAR(scene->meshes[0].vertices[1].uv.x, 0.5, 1e-6);
    EXPECT_NEAR(scene->meshes[0].vertices[1].uv.y, -1.75, 1e-6);
}

TEST_F(AssetsGltf, CameraLooksAlongMinusZ) {
    Json document = triangle();
    document["cameras"] = Json::parse(R"([{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}},
                                          {"type": "orthographic", "orthographic": {"xmag":1,"ymag":1,"zfar":9,"znear":1}}])");
    document["nodes"].push_back(Json::parse(R"({"camera": 0, "translation": [1, 2, 3],
        "rotation": [0, 0.70710678118654752, 0, 0.70710678118654752]})"));
    document["nodes"].push_back({{"camera", 1}});
    document["scenes"][0]["nodes"] = {0, 1, 2};
    const auto scene = good(document);
    ASSERT_EQ(scene->cameras.size(), 1u);
    EXPECT_TRUE(warns(*scene, "orthographic"));
    const Camera& camera = scene->cameras[0];
    EXPECT_DOUBLE_EQ(camera.fov_rad, 0.8);
    EXPECT_EQ(camera.eye, glm::dvec3(1, 2, 3));
    const glm::dvec3 forward = glm::normalize(camera.target - camera.eye);
    EXPECT_NEAR(forward.x, -1.0, 1e-12);
}

// What the file says is what set_camera can say again, as a restart does.
TEST_F(AssetsGltf, FieldsOfViewAreThoseThatSetCameraTakes) {
    Json document = triangle();
    document["nodes"].push_back(Json::parse(R"({"camera": 0, "translation": [0, 0, 3]})"));
    document["scenes"][0]["nodes"] = {0, 1};
    const struct {
        double yfov, is;
    } cases[] = {{0.001, 0.02}, {1e-6, 0.02}, {0.02, 0.02}, {0.03, 0.03}, {3.0, 3.0}, {3.1, 3.0}};
    for (const auto& [yfov, is] : cases) {
        SCOPED_TRACE(yfov);
        document["cameras"] = Json::array({{{"type", "perspective"}, {"perspective", {{"yfov", yfov}, {"znear", 1}}}}});
        const auto asset = good(document);
        ASSERT_EQ(asset->cameras.size(), 1u);
        EXPECT_EQ(asset->cameras[0].fov_rad, is);
        EXPECT_EQ(warns(*asset, "/cameras/0/perspective/yfov"), yfov != is);
        Scene scene = scene_of(asset);
        v1::Command command;
        command.mutable_set_camera()->set_fov_rad(scene.camera.fov_rad);
        const auto applied = apply(scene, command, {});
        EXPECT_TRUE(applied) << applied.error().text();
    }
}

Json with_punctual(Json document) {
    document["extensions"]["KHR_lights_punctual"]["lights"] = Json::parse(R"([
        {"type": "point", "intensity": 120, "color": [1, 0.5, 0.25], "name": "bulb"},
        {"type": "spot", "intensity": 900, "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.5}},
        {"type": "directional", "intensity": 3}])");
    for (int i = 0; i < 3; ++i) {
        document["nodes"].push_back(
            {{"extensions", {{"KHR_lights_punctual", {{"light", i}}}}}, {"translation", {0, i, 0}}});
        document["scenes"][0]["nodes"].push_back(i + 1);
    }
    document["extensionsUsed"] = {"KHR_lights_punctual"};
    return document;
}

TEST_F(AssetsGltf, PunctualLightsAreInCandelaAndTheSunInLux) {
    const auto scene = good(with_punctual(triangle()));
    ASSERT_EQ(scene->lights.size(), 3u);
    EXPECT_FALSE(warns(*scene, "directional"));
    const LightSeed& sun = scene->lights[2];
    EXPECT_TRUE(sun.sun);
    EXPECT_EQ(sun.multiplier, 3.0);
    EXPECT_EQ(sun.profile->peak_cd, 1.0);
    EXPECT_FALSE(scene->lights[0].sun || scene->lights[1].sun);
    const LightSeed& point = scene->lights[0];
    EXPECT_EQ(point.name, "bulb");
    EXPECT_DOUBLE_EQ(point.multiplier, 120.0);
    EXPECT_EQ(point.color, glm::dvec3(1, 0.5, 0.25));
    EXPECT_DOUBLE_EQ(intensity(point.profile->photometry.web, {0.3, -0.5, 0.8}).in(cd), 1.0);
    EXPECT_NEAR(point.profile->flux_lm, 4 * kPi, 1e-3);
    const LightSeed& spot = scene->lights[1];
    EXPECT_EQ(spot.position, glm::dvec3(0, 1, 0));
    for (const double v : {0.0, 0.1, 0.2, 0.3, 0.4, 0.45, 0.499, 0.6, 3.0}) {
        const double scaled = std::clamp((std::cos(v) - std::cos(0.5)) / (std::cos(0.2) - std::cos(0.5)), 0.0, 1.0);
        const auto i = intensity(spot.profile->photometry.web, {std::sin(v), 0.0, -std::cos(v)});
        EXPECT_NEAR(i.in(cd), scaled * scaled, 2e-4) << v;
    }
}

TEST_F(AssetsGltf, LightTakesRotationAndIgnoresScale) {
    Json document = with_punctual(triangle());
    // Turned by 90 degrees about X, -Z becomes +Y; the node's own scale, mirrored or not, changes nothing.
    for (const Json& scale : {Json::parse("[1,1,1]"), Json::parse("[5,0.1,-3]"), Json::parse("[-1,-1,-1]")}) {
        document["nodes"][2]["rotation"] = {0.70710678118654752, 0, 0, 0.70710678118654752};
        document["nodes"][2]["scale"] = scale;
        const LightSeed light = good(document)->lights.at(1);
        EXPECT_NEAR((light.world_from_light * glm::dvec3(0, 0, -1)).y, 1.0, 1e-12);
        EXPECT_NEAR((light.world_from_light * glm::dvec3(1, 0, 0)).x, 1.0, 1e-12);
        EXPECT_DOUBLE_EQ(light.multiplier, 900.0);
    }
    // A mirrored parent mirrors the aim with the geometry around it: -Z turned towards -X by 45 degrees lands at +X.
    document["nodes"][2] = Json::parse(R"({"rotation": [0, 0.38268343236508977, 0, 0.92387953251128674],
        "extensions": {"KHR_lights_punctual": {"light": 1}}})");
    document["nodes"].push_back({{"scale", {-1, 1, 1}}, {"children", {2}}});
    document["scenes"][0]["nodes"] = {0, 4};
    const glm::dvec3 aim = good(document)->lights.at(0).world_from_light * glm::dvec3(0, 0, -1);
    EXPECT_NEAR(aim.x, std::sqrt(0.5), 1e-12);
    EXPECT_NEAR(aim.z, -std::sqrt(0.5), 1e-12);
}

TEST_F(AssetsGltf, IesLights) {
    const std::string text = ies::synthetic_lm63("downlight");
    write("down light.ies", text);
    Json document = triangle();
    const int view = add_view(document, text);
    document["extensions"]["EXT_lights_ies"]["lights"] = {
        {{"uri", "down%20light.ies"}},
        {{"uri", "data:application/octet-stream;base64," + base64(text)}, {"name", "inline"}},
        {{"bufferView", view}, {"mimeType", "application/x-ies-lm-63"}}};
    for (int i = 0; i < 3; ++i) {
        document["nodes"].push_back({{"name", "n"}, {"extensions", {{"EXT_lights_ies", {{"light", i}}}}}});
        document["scenes"][0]["nodes"].push_back(i + 1);
    }
    document["nodes"][1]["extensions"]["EXT_lights_ies"]["multiplier"] = 0.5;
    document["nodes"][1]["extensions"]["EXT_lights_ies"]["color"] = {1, 0.9, 0.8};
    document["extensionsUsed"] = document["extensionsRequired"] = {"EXT_lights_ies"};
    const auto scene = good(document);
    ASSERT_EQ(scene->lights.size(), 3u);
    const auto builtin = builtin_profile("downlight");
    ASSERT_TRUE(builtin);
    for (const LightSeed& light : scene->lights) EXPECT_DOUBLE_EQ(light.profile->peak_cd, (*builtin)->peak_cd);
    EXPECT_EQ(scene->lights[0].profile->name, "down%20light.ies");
    EXPECT_EQ(scene->lights[1].profile->name, "inline");
    EXPECT_DOUBLE_EQ(scene->lights[0].multiplier, 0.5);
    EXPECT_EQ(scene->lights[0].color, glm::dvec3(1, 0.9, 0.8));
    EXPECT_EQ(scene->lights[1].name, "n 2");  // names are unique
}

TEST_F(AssetsGltf, TooManyLightsAreLeftOutWithAWarning) {
    Json document = with_punctual(triangle());
    for (int i = 4; i < 1100; ++i) {
        document["nodes"].push_back({{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
        document["scenes"][0]["nodes"].push_back(i);
    }
    const auto scene = good(document);
    EXPECT_EQ(scene->lights.size(), kMaxLights);
    EXPECT_TRUE(warns(*scene, "1024 lights"));
}

TEST_F(AssetsGltf, BinaryContainer) {
    Json document = triangle();
    const std::string uri = document["buffers"][0]["uri"];
    document["buffers"][0].erase("uri");
    const std::string path = write("t.glb", glb(document.dump(), bytes_of({0, 0, 0, 1, 0, 0, 0, 1, 0})));
    const auto scene = load_scene(path);
    ASSERT_TRUE(scene) << scene.error().text();
    EXPECT_EQ((*scene)->triangles(), 1u);
}

TEST_F(AssetsGltf, UnknownOptionalExtensionWarns) {
    Json document = triangle();
    document["extensionsUsed"] = {"VENDOR_thing"};
    EXPECT_TRUE(warns(*good(document), "VENDOR_thing is not known and was ignored; perhaps it changes lux"));
}

TEST(AssetsSharedScenes, BrokenOnesAreRefusedAndTheOthersLoad) {
    const auto folder = test::shared_data("scenes");
    if (!folder) GTEST_SKIP() << "no shared scenes on this machine";
    int refused = 0, loaded = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(*folder)) {
        const std::string extension = entry.path().extension();
        if (extension != ".gltf" && extension != ".glb") continue;
        const auto scene = load_scene(entry.path());
        if (entry.path().parent_path().filename() == "BoundsChecking") {
            ASSERT_FALSE(scene) << entry.path();
            EXPECT_TRUE(scene.error().code == "too_large" || scene.error().code == "out_of_bounds" ||
                        scene.error().code == "bad_gltf")
                << entry.path();
            EXPECT_EQ(scene.error().where[0], '/') << entry.path();
            EXPECT_FALSE(scene.error().value.empty()) << entry.path();
            ++refused;
        } else {
            ASSERT_TRUE(scene) << entry.path() << ": " << scene.error().text();
            EXPECT_GT((*scene)->triangles(), 0u) << entry.path();
            ++loaded;
        }
    }
    EXPECT_EQ(refused, 4);
    EXPECT_GE(loaded, 9);
}

}  // namespace
}  // namespace gonio
