// Builds small glTF documents in a temporary directory for the import tests.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "server/assets/assets.h"

namespace gonio {

using Json = nlohmann::json;

inline std::string base64(const std::string& bytes) {
    static const char* alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t held = 0;
        for (std::size_t k = 0; k < 3; ++k)
            held = held << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
        for (std::size_t k = 0; k < 4; ++k) text += i + k > bytes.size() ? '=' : alphabet[held >> (18 - 6 * k) & 63u];
    }
    return text;
}

inline std::string bytes_of(const std::vector<float>& values) {
    std::string bytes(values.size() * sizeof(float), '\0');
    std::memcpy(bytes.data(), values.data(), bytes.size());
    return bytes;
}

// Appends a buffer with one view over `bytes`. Result: the view's index.
inline int add_view(Json& document, const std::string& bytes) {
    document["buffers"].push_back(
        {{"byteLength", bytes.size()}, {"uri", "data:application/octet-stream;base64," + base64(bytes)}});
    document["bufferViews"].push_back({{"buffer", document["buffers"].size() - 1}, {"byteLength", bytes.size()}});
    return static_cast<int>(document["bufferViews"].size()) - 1;
}

inline int add_accessor(Json& document, const std::string& bytes, int type, int count, const char* shape,
                        bool normalised = false) {
    const int view = add_view(document, bytes);
    document["accessors"].push_back(
        {{"bufferView", view}, {"componentType", type}, {"count", count}, {"type", shape}, {"normalized", normalised}});
    return static_cast<int>(document["accessors"].size()) - 1;
}

inline Json with_positions(const std::vector<float>& positions) {
    Json document = Json::parse(R"({"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}]})");
    add_accessor(document, bytes_of(positions), 5126, static_cast<int>(positions.size() / 3), "VEC3");
    return document;
}

// (0,0,0) (1,0,0) (0,1,0)
inline Json triangle() {
    return with_positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
}

// The triangle with texture coordinates (0,0) (1,0) (0,1) and a base colour texture.
inline Json textured(const std::string& uri) {
    Json document = triangle();
    add_accessor(document, bytes_of({0, 0, 1, 0, 0, 1}), 5126, 3, "VEC2");
    Json& primitive = document["meshes"][0]["primitives"][0];
    primitive["attributes"]["TEXCOORD_0"] = 1;
    primitive["material"] = 0;
    document["materials"] = Json::parse(R"([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}])");
    document["textures"] = Json::parse(R"([{"source": 0}])");
    document["images"] = Json::array({Json{{"uri", uri}}});
    return document;
}

inline std::string little_endian(std::size_t value) {
    std::string bytes;
    for (int i = 0; i < 4; ++i) bytes += static_cast<char>(value >> (8 * i) & 255u);
    return bytes;
}

inline std::string glb(std::string json, std::string binary) {
    json.resize((json.size() + 3) / 4 * 4, ' ');
    binary.resize((binary.size() + 3) / 4 * 4, '\0');
    return "glTF" + little_endian(2) + little_endian(28 + json.size() + binary.size()) + little_endian(json.size()) +
           "JSON" + json + little_endian(binary.size()) + std::string("BIN\0", 4) + binary;
}

class GltfFixture : public ::testing::Test {
protected:
    void SetUp() override {
        std::string pattern = (std::filesystem::temp_directory_path() / "gonio-gltf-XXXXXX").string();
        ASSERT_NE(mkdtemp(pattern.data()), nullptr);
        directory_ = std::filesystem::path(pattern) / "scene";  // with a parent that tests may try to escape into
        std::filesystem::create_directory(directory_);
    }
    void TearDown() override { std::filesystem::remove_all(directory_.parent_path()); }

    template <typename Bytes>
    std::string write(const std::string& name, const Bytes& bytes) {
        const std::filesystem::path path = directory_ / name;
        std::ofstream(path, std::ios::binary)
            .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
        return path;
    }
    Result<std::shared_ptr<const SceneAsset>> load(const Json& document) {
        return load_scene(write("scene.gltf", document.dump()));
    }
    // Result: the scene, or an empty one with the failure noted.
    std::shared_ptr<const SceneAsset> good(const Json& document) {
        auto scene = load(document);
        EXPECT_TRUE(scene.ok()) << scene.error().text();
        return scene ? *scene : std::make_shared<const SceneAsset>();
    }
    static bool warns(const SceneAsset& scene, const std::string& words) {
        for (const std::string& warning : scene.warnings) {
            if (warning.find(words) != std::string::npos) return true;
        }
        return false;
    }

    std::filesystem::path directory_;
};

}  // namespace gonio
