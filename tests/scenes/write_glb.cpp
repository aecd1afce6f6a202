#include "tests/scenes/write_glb.h"

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>
#include <vector>

#include "ies/writers.h"

namespace gonio::test {
namespace {

using Json = nlohmann::json;

// glTF 2.0, 3.6: component types and buffer view targets; 4.4: the chunks of a .glb.
constexpr int kFloat = 5126, kUnsignedInt = 5125;
constexpr std::uint32_t kMagic = 0x46546C67, kVersion = 2, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;

Json list(const glm::dvec3& v) {
    return Json{v.x, v.y, v.z};
}

class Writer {
public:
    explicit Writer(const SceneAsset& asset) : asset_(asset) {}

    std::string run() {
        document_["asset"] = {{"version", "2.0"}, {"generator", "gonio tests"}};
        document_["scene"] = 0;
        document_["nodes"] = Json::array();
        for (const Material& material : asset_.materials) add(material);
        for (const Mesh& mesh : asset_.meshes) add(mesh);
        for (const Instance& instance : asset_.instances) {
            Json node = {{"name", instance.node}, {"mesh", instance.mesh}};
            Json matrix = Json::array();
            for (int i = 0; i < 16; ++i) matrix.push_back(instance.world_from_mesh[i / 4][i % 4]);
            node["matrix"] = std::move(matrix);
            add_node(std::move(node));
        }
        for (const Camera& camera : asset_.cameras) add(camera);
        for (const LightSeed& light : asset_.lights) add(light);
        document_["scenes"] = {{{"nodes", roots_}}};
        if (!asset_.lights.empty()) document_["extensionsUsed"].push_back("EXT_lights_ies");
        if (emissive_) document_["extensionsUsed"].push_back("KHR_materials_emissive_strength");
        return file();
    }

private:
    void add_node(Json node) {
        roots_.push_back(document_["nodes"].size());
        document_["nodes"].push_back(std::move(node));
    }

    std::size_t add_view(const void* bytes, std::size_t size) {
        document_["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", size}});
        binary_.append(static_cast<const char*>(bytes), size);
        binary_.resize((binary_.size() + 3) / 4 * 4, '\0');
        return document_["bufferViews"].size() - 1;
    }

    template <typename T>
    std::size_t add_accessor(const std::vector<T>& values, int component_type, const char* type, Json limits = {}) {
        Json accessor = {{"bufferView", add_view(values.data(), values.size() * sizeof(T))},
                         {"componentType", component_type},
                         {"count", values.size()},
                         {"type", type}};
        accessor.update(limits.is_null() ? Json::object() : limits);
        document_["accessors"].push_back(std::move(accessor));
        return document_["accessors"].size() - 1;
    }

    void add(const Material& from) {
        const glm::vec4 c = from.base_color;
        Json material = {
            {"name", from.name},
            {"pbrMetallicRoughness",
             {{"baseColorFactor", {c.r, c.g, c.b, c.a}}, {"metallicFactor", 0.0}, {"roughnessFactor", 1.0}}},
            {"doubleSided", from.double_sided}};
        const float strength = std::max({from.emissive_nit.r, from.emissive_nit.g, from.emissive_nit.b});
        if (strength > 0.0f) {
            emissive_ = true;
            material["emissiveFactor"] = list(glm::dvec3(from.emissive_nit) / static_cast<double>(strength));
            material["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = strength;
        }
        if (from.alpha_mask) {
            material["alphaMode"] = "MASK";
            material["alphaCutoff"] = from.alpha_cutoff;
        }
        document_["materials"].push_back(std::move(material));
    }

    void add(const Mesh& mesh) {
        std::vector<glm::vec3> positions, normals;
        std::vector<glm::vec2> uvs;
        glm::vec3 low(1e30f), high(-1e30f);
        for (const Vertex& vertex : mesh.vertices) {
            positions.push_back(vertex.position);
            normals.push_back(vertex.normal);
            uvs.push_back(vertex.uv);
            low = glm::min(low, vertex.position);
            high = glm::max(high, vertex.position);
        }
        const Json limits = {{"min", list(low)}, {"max", list(high)}};
        const Json attributes = {{"POSITION", add_accessor(positions, kFloat, "VEC3", limits)},
                                 {"NORMAL", add_accessor(normals, kFloat, "VEC3")},
                                 {"TEXCOORD_0", add_accessor(uvs, kFloat, "VEC2")}};
        document_["meshes"].push_back({{"primitives",
                                        {{{"attributes", attributes},
                                          {"indices", add_accessor(mesh.indices, kUnsignedInt, "SCALAR")},
                                          {"material", mesh.material}}}}});
    }

    void add(const Camera& camera) {
        const glm::dvec3 back = glm::normalize(camera.eye - camera.target),
                         right = glm::normalize(glm::cross(glm::dvec3(0, 1, 0), back)), up = glm::cross(back, right);
        document_["cameras"].push_back(
            {{"type", "perspective"}, {"perspective", {{"yfov", camera.fov_rad}, {"znear", 0.01}}}});
        const glm::dquat turn = glm::quat_cast(glm::dmat3(right, up, back));
        add_node({{"name", "camera"},
                  {"camera", document_["cameras"].size() - 1},
                  {"translation", list(camera.eye)},
                  {"rotation", {turn.x, turn.y, turn.z, turn.w}}});
    }

    void add(const LightSeed& light) {
        const std::string text = ies::write_lm63(light.profile->photometry);
        Json& lights = document_["extensions"]["EXT_lights_ies"]["lights"];
        lights.push_back({{"name", light.profile->name},
                          {"mimeType", "application/x-ies-lm-63"},
                          {"bufferView", add_view(text.data(), text.size())}});
        const glm::dquat turn = glm::normalize(light.world_from_light);
        const Json use = {{"light", lights.size() - 1}, {"multiplier", light.multiplier}, {"color", list(light.color)}};
        add_node({{"name", light.name},
                  {"translation", list(light.position)},
                  {"rotation", {turn.x, turn.y, turn.z, turn.w}},
                  {"extensions", {{"EXT_lights_ies", use}}}});
    }

    std::string file() {
        document_["buffers"] = {{{"byteLength", binary_.size()}}};
        std::string json = document_.dump();
        json.resize((json.size() + 3) / 4 * 4, ' ');
        std::string bytes;
        const auto word = [&bytes](std::size_t value) {  // little endian
            for (unsigned k = 0; k < 4; ++k) bytes.push_back(static_cast<char>(value >> (8 * k) & 0xFF));
        };
        for (std::size_t value : {std::size_t{kMagic}, std::size_t{kVersion}, 28 + json.size() + binary_.size(),
                                  json.size(), std::size_t{kJsonChunk}})
            word(value);
        bytes += json;
        word(binary_.size());
        word(kBinaryChunk);
        return bytes + binary_;
    }

    const SceneAsset& asset_;
    Json document_;
    Json roots_ = Json::array();
    std::string binary_;
    bool emissive_ = false;
};

}  // namespace

Result<std::string> write_glb(const SceneAsset& asset) {
    if (!asset.images.empty()) {
        return Error{"unsupported", "images", std::to_string(asset.images.size()), "textures are not written"};
    }
    return Writer(asset).run();
}

}  // namespace gonio::test
