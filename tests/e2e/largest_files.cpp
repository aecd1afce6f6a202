#include "tests/e2e/largest_files.h"

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <vector>

namespace gonio::test {

std::string fine_ies(int angles) {
    std::string text = "IESNA:LM-63-2002\n[TEST] x\n[TESTLAB] x\n[ISSUEDATE] x\n[MANUFAC] x\nTILT=NONE\n1 -1 1 " +
                       std::to_string(angles) + " 1 1 2 0 0 0\n1 1 10\n";
    char number[32];
    for (int i = 0; i < angles; ++i) {
        std::snprintf(number, sizeof number, "%.7g\n", 180.0 * i / (angles - 1));
        text += number;
    }
    text += "0\n";
    for (int i = 0; i < angles; ++i) text += i % 3 == 0 ? "9\n" : "8\n";
    return text;
}

std::string hills_glb(int side) {
    std::vector<float> positions, normals;
    std::vector<std::uint32_t> indices;
    for (int y = 0; y <= side; ++y) {
        for (int x = 0; x <= side; ++x) {
            const float px = 20.0f * static_cast<float>(x) / static_cast<float>(side) - 10.0f,
                        pz = 20.0f * static_cast<float>(y) / static_cast<float>(side) - 10.0f;
            positions.insert(positions.end(), {px, 0.2f * std::sin(3 * px) * std::cos(2 * pz), pz});
            normals.insert(normals.end(), {0, 1, 0});
        }
    }
    const auto at = [&](int x, int y) { return static_cast<std::uint32_t>(y * (side + 1) + x); };
    for (int y = 0; y < side; ++y) {
        for (int x = 0; x < side; ++x)
            indices.insert(indices.end(),
                           {at(x, y), at(x, y + 1), at(x + 1, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1)});
    }
    std::string binary;
    const auto put = [&](const auto& values) {
        binary.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof values[0]);
        return values.size() * sizeof values[0];
    };
    const std::size_t a = put(positions), b = put(normals), c = put(indices), count = positions.size() / 3;
    nlohmann::json gltf = {
        {"asset", {{"version", "2.0"}}},
        {"scene", 0},
        {"scenes", {{{"nodes", {0, 1}}}}},
        {"nodes",
         {{{"mesh", 0}},
          {{"name", "luminaire"},
           {"translation", {0, 4, 0}},
           {"rotation", {-0.70710678, 0, 0, 0.70710678}},
           {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}}}},
        {"extensionsUsed", {"KHR_lights_punctual"}},
        {"extensions", {{"KHR_lights_punctual", {{"lights", {{{"type", "point"}, {"intensity", 500}}}}}}}},
        {"materials", {{{"pbrMetallicRoughness", {{"baseColorFactor", {0.5, 0.5, 0.5, 1}}}}}}},
        {"meshes",
         {{{"primitives", {{{"attributes", {{"POSITION", 0}, {"NORMAL", 1}}}, {"indices", 2}, {"material", 0}}}}}}},
        {"buffers", {{{"byteLength", binary.size()}}}},
        {"bufferViews",
         {{{"buffer", 0}, {"byteOffset", 0}, {"byteLength", a}},
          {{"buffer", 0}, {"byteOffset", a}, {"byteLength", b}},
          {{"buffer", 0}, {"byteOffset", a + b}, {"byteLength", c}}}},
        {"accessors",
         {{{"bufferView", 0},
           {"componentType", 5126},
           {"count", count},
           {"type", "VEC3"},
           {"min", {-10, -1, -10}},
           {"max", {10, 1, 10}}},
          {{"bufferView", 1}, {"componentType", 5126}, {"count", count}, {"type", "VEC3"}},
          {{"bufferView", 2}, {"componentType", 5125}, {"count", indices.size()}, {"type", "SCALAR"}}}}};
    std::string json = gltf.dump();
    json.resize((json.size() + 3) / 4 * 4, ' ');
    const auto word = [](std::size_t value) {
        const auto bits = static_cast<std::uint32_t>(value);
        return std::string(reinterpret_cast<const char*>(&bits), 4);
    };
    return "glTF" + word(2) + word(28 + json.size() + binary.size()) + word(json.size()) + "JSON" + json +
           word(binary.size()) + std::string("BIN\0", 4) + binary;
}

}  // namespace gonio::test
