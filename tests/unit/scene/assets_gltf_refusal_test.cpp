// glTF import: every refusal has a code, a place and the offending value; nothing from a file crashes or runs away.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <filesystem>
#include <limits>
#include <random>

#include "ies/synthetic.h"
#include "server/assets/assets.h"
#include "server/scene/scene.h"
#include "tests/unit/assets_gltf_fixture.h"

namespace gonio {
namespace {

class AssetsGltfRefusal : public GltfFixture {
protected:
    void refused(const Json& document, const std::string& code, const std::string& where, const std::string& value) {
        expect(load(document), code, where, value);
    }
    static void expect(const Result<std::shared_ptr<const SceneAsset>>& result, const std::string& code,
                       const std::string& where, const std::string& value) {
        ASSERT_FALSE(result) << code << " at " << where;
        EXPECT_EQ(result.error().code, code) << result.error().text();
        EXPECT_EQ(result.error().where, where) << result.error().text();
        EXPECT_EQ(result.error().value, value) << result.error().text();
        EXPECT_FALSE(result.error().message.empty());
    }
};

// The full document that the table below breaks: texture, indices, camera, two kinds of light.
Json whole() {
    Json document = textured(
        "data:image/png;base64,"
        "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABEAAAAABq7kcWAAAAC0lEQVR4nGNoaAAAAYMBARg1IhUAAAAASUVORK5CYII=");
    add_accessor(document, std::string("\x00\x01\x02", 3), 5121, 3, "SCALAR");
    document["meshes"][0]["primitives"][0]["indices"] = 2;
    document["cameras"] = Json::parse(R"([{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}])");
    document["samplers"] = Json::parse(R"([{}])");
    document["textures"][0]["sampler"] = 0;
    document["nodes"] = Json::parse(R"([{"mesh": 0, "children": [1, 2]}, {"camera": 0},
        {"extensions": {"KHR_lights_punctual": {"light": 0}}}])");
    document["extensions"]["KHR_lights_punctual"]["lights"] = Json::parse(R"([{"type": "spot", "spot": {}}])");
    document["scene"] = 0;
    return document;
}

TEST_F(AssetsGltfRefusal, ByPlaceAndValue) {
    const auto unbroken = load(whole());
    ASSERT_TRUE(unbroken) << unbroken.error().text();
    struct Case {
        const char* pointer;
        Json value;
        const char* code;
        const char* where;  // empty: the pointer itself
        const char* shown;
    };
    const Case cases[] = {
        {"/scene", 1, "out_of_bounds", "", "1"},
        {"/scenes/0/nodes/0", 7, "out_of_bounds", "", "7"},
        {"/nodes/0/mesh", -1, "out_of_bounds", "", "-1"},
        {"/nodes/0/mesh", "0", "bad_gltf", "", "\"0\""},
        {"/nodes/0/children", {1, 1}, "bad_gltf", "/nodes/0/children/1", "1"},
        {"/nodes/1/camera", 3, "out_of_bounds", "", "3"},
        {"/nodes/1/children", {2}, "bad_gltf", "/nodes/1/children/0", "2"},
        {"/nodes/0/rotation", {0, 0, 0, 0}, "bad_gltf", "", "0"},
        {"/nodes/0/scale", {1, 2}, "bad_gltf", "", "[1,2]"},
        {"/nodes/2/extensions/KHR_lights_punctual/light", 1, "out_of_bounds", "", "1"},
        {"/extensions/KHR_lights_punctual/lights/0/intensity", -5, "bad_gltf", "", "-5"},
        {"/extensions/KHR_lights_punctual/lights/0/type", "neon", "bad_gltf", "", "neon"},
        {"/meshes/0/primitives/0/attributes/POSITION", 9, "out_of_bounds", "", "9"},
        {"/meshes/0/primitives/0/attributes/POSITION", 1, "bad_gltf", "", "1"},
        {"/meshes/0/primitives/0/attributes/NORMAL", 1, "bad_gltf", "", "1"},
        {"/meshes/0/primitives/0/indices", 3, "out_of_bounds", "", "3"},
        {"/meshes/0/primitives/0/indices", 0, "bad_gltf", "/accessors/0/componentType", "5126"},
        {"/meshes/0/primitives/0/material", 1, "out_of_bounds", "", "1"},
        {"/meshes/0/primitives/0/mode", 7, "bad_gltf", "", "7"},
        {"/accessors/0/count", 4, "out_of_bounds", "", "4"},
        {"/accessors/0/count", 2147483647, "out_of_bounds", "", "2147483647"},
        {"/accessors/0/count", 1e300, "too_large", "", "1e+300"},
        {"/bufferViews/0/byteLength", std::uint64_t{1} << 63, "too_large", "", "9223372036854775808"},
        {"/accessors/0/byteOffset", 4, "out_of_bounds", "/accessors/0/count", "3"},
        {"/accessors/0/componentType", 5124, "bad_gltf", "", "5124"},
        {"/accessors/0/type", "VEC5", "bad_gltf", "", "\"VEC5\""},
        {"/accessors/0/bufferView", 3, "out_of_bounds", "", "3"},
        {"/bufferViews/0/buffer", 3, "out_of_bounds", "", "3"},
        {"/bufferViews/0/byteLength", 37, "out_of_bounds", "", "37"},
        {"/bufferViews/0/byteStride", 6, "bad_gltf", "", "6"},
        {"/buffers/0/byteLength", 37, "out_of_bounds", "", "37"},
        {"/buffers/0/byteLength", 2000000000, "too_large", "", "2000000000"},
        {"/materials/0/alphaMode", "GLOW", "bad_gltf", "", "GLOW"},
        {"/materials/0/pbrMetallicRoughness/baseColorFactor", {1, 1, 1}, "bad_gltf", "", "[1,1,1]"},
        {"/cameras/0/perspective/yfov", 0, "bad_gltf", "", "0.000000"},
        {"/buffers/0/uri", "missing.bin", "missing_file", "", "missing.bin"},
        {"/buffers/0/uri", "data:;base64,A*AA", "bad_gltf", "", "data:;base64,A*AA"},
        {"/asset/version", "1.0", "unsupported", "", "\"1.0\""},
        {"/asset/minVersion", "2.1", "unsupported", "", "\"2.1\""},
        {"/nodes/0/mesh", 0.5, "bad_gltf", "", "0.5"},
        {"/extensionsRequired", {"VENDOR_thing"}, "unsupported", "/extensionsRequired/0", "VENDOR_thing"},
    };
    for (const Case& broken : cases) {
        Json document = whole();
        document[Json::json_pointer(broken.pointer)] = broken.value;
        SCOPED_TRACE(std::string(broken.pointer) + " = " + broken.value.dump());
        refused(document, broken.code, *broken.where ? broken.where : broken.pointer, broken.shown);
    }
}

TEST_F(AssetsGltfRefusal, NodeCycle) {
    Json document = triangle();
    document["nodes"] = Json::parse(R"([{"mesh": 0}, {"children": [2]}, {"children": [1]}])");
    refused(document, "bad_gltf", "/nodes/1/children", "[2]");
}

TEST_F(AssetsGltfRefusal, ValuesThatAreNotFinite) {
    Json document = triangle();
    document["nodes"][0]["translation"] = {1e300, 0, 0};
    document["nodes"][0]["name"] = "far";
    refused(document, "bad_gltf", "/nodes/0", "far");
}

TEST_F(AssetsGltfRefusal, IndexBeyondTheVertices) {
    Json document = triangle();
    add_accessor(document, std::string("\x00\x01\x03", 3), 5121, 3, "SCALAR");
    document["meshes"][0]["primitives"][0]["indices"] = 1;
    refused(document, "out_of_bounds", "/meshes/0/primitives/0/indices", "3");
}

TEST_F(AssetsGltfRefusal, SparseIndexBeyondTheElements) {
    Json document = triangle();
    add_accessor(document, std::string("\x03", 1), 5121, 1, "SCALAR");
    add_accessor(document, bytes_of({0, 5, 0}), 5126, 1, "VEC3");
    document["accessors"][0]["sparse"] = {
        {"count", 1}, {"indices", {{"bufferView", 1}, {"componentType", 5121}}}, {"values", {{"bufferView", 2}}}};
    refused(document, "out_of_bounds", "/accessors/0/sparse/indices", "3");
    document["accessors"][0]["sparse"]["count"] = 2;
    refused(document, "out_of_bounds", "/accessors/0/sparse/indices", "2");
}

TEST_F(AssetsGltfRefusal, CountsWithoutBytesBehindThem) {
    Json document = triangle();
    document["accessors"][0].erase("bufferView");
    document["accessors"][0]["count"] = 2147483647;
    refused(document, "too_large", "/meshes/0/primitives/0/attributes/POSITION", "2147483647");
}

TEST_F(AssetsGltfRefusal, PathsThatLeaveTheDirectory) {
    const std::string bytes = bytes_of({0, 0, 0, 1, 0, 0, 0, 1, 0});
    write("../outside.bin", bytes);
    std::filesystem::create_symlink(directory_.parent_path() / "outside.bin", directory_ / "link.bin");
    Json document = triangle();
    for (const std::string& uri : {std::string("../outside.bin"), std::string("a/../../outside.bin"),
                                   std::string("%2e%2e/outside.bin"), std::string("link.bin"), std::string("/dev/zero"),
                                   std::string("%2Fdev%2Fzero"), std::string("."), std::string("")}) {
        document["buffers"][0]["uri"] = uri;
        SCOPED_TRACE(uri);
        refused(document, "bad_gltf", "/buffers/0/uri", uri);
    }
    document["buffers"][0]["uri"] = "file:///dev/zero";
    refused(document, "unsupported", "/buffers/0/uri", "file:///dev/zero");
}

TEST_F(AssetsGltfRefusal, SmallFilesThatGrowTooLarge) {
    constexpr int kTriangles = 1 << 14;
    std::string indices;
    for (int i = 0; i < kTriangles; ++i) indices += std::string("\0\1\2", 3);
    Json document = triangle();
    document["meshes"][0]["primitives"][0]["indices"] = add_accessor(document, indices, 5121, 3 * kTriangles, "SCALAR");
    const auto with_nodes = [&](int count) {
        document["nodes"] = Json::array();
        document["scenes"][0]["nodes"] = Json::array();
        for (int i = 0; i < count; ++i) {
            document["nodes"].push_back({{"mesh", 0}});
            document["scenes"][0]["nodes"].push_back(i);
        }
        return document;
    };
    EXPECT_TRUE(load(with_nodes(1 << 10))) << "2^24 triangles";
    refused(with_nodes((1 << 10) + 1), "too_large", "/nodes/1024/mesh", "0");
}

TEST_F(AssetsGltfRefusal, IesLights) {
    Json document = triangle();
    document["nodes"][0]["extensions"]["EXT_lights_ies"]["light"] = 0;
    Json& light = document["extensions"]["EXT_lights_ies"]["lights"][0];
    write("good.ies", ies::synthetic_lm63("bulb"));
    light = {{"uri", "good.ies"}};
    document["nodes"][0]["extensions"]["EXT_lights_ies"]["multiplier"] = -1;
    refused(document, "bad_gltf", "/nodes/0/extensions/EXT_lights_ies/multiplier", "-1");
}

TEST_F(AssetsGltfRefusal, AFileThatIsThereIsNotMissedForWantOfADescriptor) {
    const std::string path = write("there.gltf", triangle().dump());
    rlimit before{};
    ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
    const rlimit none{0, before.rlim_max};
    ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
    const auto refused = load_scene(path);
    setrlimit(RLIMIT_NOFILE, &before);
    expect(refused, "file_unreadable", path, "");
    EXPECT_TRUE(load_scene(path));
}

TEST_F(AssetsGltfRefusal, FilesThatAreNoGltf) {
    expect(load_scene((directory_ / "nothing.gltf").string()), "not_found", (directory_ / "nothing.gltf").string(), "");
    expect(load_scene(directory_.string()), "not_found", directory_.string(), "");
    expect(load_scene(write("empty.gltf", std::string())), "bad_gltf", "byte 1", "");
    expect(load_scene(write("list.gltf", std::string("[]"))), "bad_gltf", "", "[]");
    const std::string text = triangle().dump();
    const auto cut = load_scene(write("cut.gltf", text.substr(0, text.size() / 2)));
    ASSERT_FALSE(cut);
    EXPECT_EQ(cut.error().code, "bad_gltf");
    EXPECT_EQ(cut.error().where.rfind("byte ", 0), 0u);
    expect(load_scene(write("deep.gltf", std::string(1000000, '['))), "bad_gltf", "byte 128", "");
    std::string wide = "[";
    for (int i = 0; i < 9000000; ++i) wide += "0,";
    const auto many = load_scene(write("wide.gltf", wide));
    ASSERT_FALSE(many);
    EXPECT_EQ(many.error().code, "too_large");
}

TEST_F(AssetsGltfRefusal, BinaryContainers) {
    Json document = triangle();
    document["buffers"][0].erase("uri");
    const std::string whole_file = glb(document.dump(), bytes_of({0, 0, 0, 1, 0, 0, 0, 1, 0}));
    ASSERT_TRUE(load_scene(write("t.glb", whole_file)));
    for (std::size_t size = 4; size < whole_file.size(); ++size) {
        const auto result = load_scene(write("t.glb", whole_file.substr(0, size)));
        ASSERT_FALSE(result) << size;
        EXPECT_EQ(result.error().code, "bad_gltf") << size;
    }
    std::string broken = whole_file;
    broken[4] = 1;
    expect(load_scene(write("t.glb", broken)), "unsupported", "byte 4", "1");
    broken = whole_file;
    broken[12] = broken[13] = '\x7f';  // length of the first chunk
    EXPECT_FALSE(load_scene(write("t.glb", broken)));
    // A JSON that speaks of more than the chunk holds.
    document["buffers"][0]["byteLength"] = 44;
    expect(load_scene(write("t.glb", glb(document.dump(), std::string(36, '\0')))), "out_of_bounds",
           "/buffers/0/byteLength", "44");
}

// Documents with one or two bytes changed: whatever they mean now, the answer is a scene or an error.
TEST_F(AssetsGltfRefusal, MutationsAnswer) {
    const std::string text = whole().dump();
    std::mt19937 random(7);
    for (int i = 0; i < 1500; ++i) {
        std::string mutated = text;
        for (int k = 0; k < 1 + i % 2; ++k) {
            static const std::string spice = "0123456789-eE.,:[]{}\"xnt\\ ";
            mutated[random() % mutated.size()] = spice[random() % spice.size()];
        }
        const auto result = load_scene(write("m.gltf", mutated));
        if (!result) {
            EXPECT_FALSE(result.error().code.empty());
            EXPECT_FALSE(result.error().message.empty());
        }
    }
}

}  // namespace
}  // namespace gonio
