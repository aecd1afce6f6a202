#include "server/bake/glb.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "server/assets/assets.h"

namespace gonio::bake {
namespace {

using Json = nlohmann::ordered_json;

// glTF 2.0, 3.6: component types; 4.4: the chunks of a .glb; 5.26: wrapping.
constexpr int kFloat = 5126, kUnsignedInt = 5125, kUnsignedShort = 5123;
constexpr std::uint32_t kMagic = 0x46546C67, kVersion = 2, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;
constexpr double kBrighter = 0.001;  // share of texels that may be brighter than the texture shows

int wrapping(Wrap wrap) {
    return wrap == Wrap::clamp ? 33071 : wrap == Wrap::repeat ? 10497 : 33648;
}

std::uint8_t srgb_encode(float linear) {
    const float c = std::clamp(linear, 0.0f, 1.0f);
    return static_cast<std::uint8_t>(
        std::lround(255.0f * (c <= 0.0031308f ? 12.92f * c : 1.055f * std::pow(c, 1.0f / 2.4f) - 0.055f)));
}

// One primitive's vertices.
struct Corners {
    std::vector<glm::vec3> positions, normals;
    std::vector<glm::vec2> uvs, map_uvs;
    std::vector<glm::u16vec4> colors;
    std::vector<std::uint32_t> indices;
};

class Writer {
public:
    Writer(const SceneAsset& asset, const Layout& layout) : asset_(asset), layout_(layout) {
        document_["asset"] = {{"version", "2.0"}, {"generator", "gonio"}};
        document_["scene"] = 0;
    }

    std::optional<Error> run(std::span<const float> luminance) {
        if (auto error = add_map(luminance)) return error;
        for (const Image& image : asset_.images) {
            auto png = encode_rgba_png(image);
            if (!png) return png.error();
            add_image(*png);
            if (binary_.size() > kMostGlbBytes) return too_large();
        }
        for (const Material& material : asset_.materials) add(material);
        std::size_t begin = 0;
        const auto& sides = layout_.atlas.sides;
        std::vector<std::vector<const PlacedSide*>> of_instance(asset_.instances.size());
        for (; begin < sides.size(); ++begin)
            of_instance[static_cast<std::size_t>(sides[begin].side.instance)].push_back(&sides[begin]);
        for (std::size_t i = 0; i < asset_.instances.size(); ++i) {
            if (of_instance[i].empty()) continue;
            add(asset_.instances[i], of_instance[i]);
            if (binary_.size() > kMostGlbBytes) return too_large();
        }
        for (const Camera& camera : asset_.cameras) add(camera);
        Json roots = Json::array();
        for (std::size_t i = 0; i < document_["nodes"].size(); ++i) roots.push_back(i);
        document_["scenes"] = Json::array({Json{{"nodes", std::move(roots)}}});
        document_["extensionsUsed"] = {"KHR_materials_emissive_strength"};
        return std::nullopt;
    }

    std::string file() {
        document_["buffers"] = Json::array({Json{{"byteLength", binary_.size()}}});
        std::string json = document_.dump(-1, ' ', false, Json::error_handler_t::replace);
        json.resize((json.size() + 3) / 4 * 4, ' ');
        std::string bytes;
        const auto word = [&bytes](std::size_t value) {  // little endian
            for (unsigned k = 0; k < 4; ++k) bytes.push_back(static_cast<char>(value >> (8 * k) & 0xFF));
        };
        for (const std::size_t value : {std::size_t{kMagic}, std::size_t{kVersion}, 28 + json.size() + binary_.size(),
                                        json.size(), std::size_t{kJsonChunk}})
            word(value);
        bytes += json;
        word(binary_.size());
        word(kBinaryChunk);
        return bytes + binary_;
    }

private:
    static Error too_large() {
        return {"too_large", "bake.glb", std::to_string(kMostGlbBytes >> 20) + " MiB",
                "the scene with its map would be a larger file"};
    }

    std::size_t add_view(const void* bytes, std::size_t size) {
        document_["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", size}});
        binary_.append(static_cast<const char*>(bytes), size);
        binary_.resize((binary_.size() + 3) / 4 * 4, '\0');
        return document_["bufferViews"].size() - 1;
    }

    template <typename T>
    std::size_t add_accessor(const std::vector<T>& values, int component_type, const char* type,
                             const Json& more = Json::object()) {
        Json accessor = {{"bufferView", add_view(values.data(), values.size() * sizeof(T))},
                         {"componentType", component_type},
                         {"count", values.size()},
                         {"type", type}};
        accessor.update(more);
        document_["accessors"].push_back(std::move(accessor));
        return document_["accessors"].size() - 1;
    }

    void add_image(const std::vector<std::byte>& png) {
        document_["images"].push_back({{"mimeType", "image/png"}, {"bufferView", add_view(png.data(), png.size())}});
    }

    // luminance: of the atlas's pixels, cd/m² rgb.
    std::optional<Error> add_map(std::span<const float> luminance) {
        std::vector<float> greatest;
        for (const Texel& texel : layout_.atlas.texels) {
            const auto p = 3 * static_cast<std::size_t>(texel.pixel);
            greatest.push_back(std::max({luminance[p], luminance[p + 1], luminance[p + 2]}));
        }
        strength_ = 1.0f;
        if (!greatest.empty()) {
            const auto at = greatest.begin() +
                            static_cast<std::ptrdiff_t>((1.0 - kBrighter) * static_cast<double>(greatest.size() - 1));
            std::nth_element(greatest.begin(), at, greatest.end());
            if (*at > 0.0f) strength_ = *at;
        }
        BytePicture picture{layout_.atlas.width, layout_.atlas.height, {}};
        picture.rgb.reserve(luminance.size());
        for (const float nit : luminance) picture.rgb.push_back(srgb_encode(nit / strength_));
        const auto png = encode_png(picture);
        if (!png) return png.error();
        add_image(*png);
        document_["samplers"].push_back({{"magFilter", 9729}, {"minFilter", 9729}, {"wrapS", 33071}, {"wrapT", 33071}});
        document_["textures"].push_back({{"source", 0}, {"sampler", 0}});
        return std::nullopt;
    }

    void add(const Material& from) {
        const glm::vec4 c = from.base_color;
        Json pbr = {{"baseColorFactor", {c.r, c.g, c.b, c.a}}, {"metallicFactor", 0.0}, {"roughnessFactor", 1.0}};
        if (from.base_color_image >= 0) {
            document_["samplers"].push_back({{"wrapS", wrapping(from.wrap_s)}, {"wrapT", wrapping(from.wrap_t)}});
            document_["textures"].push_back(
                {{"source", from.base_color_image + 1}, {"sampler", document_["samplers"].size() - 1}});
            pbr["baseColorTexture"] = {{"index", document_["textures"].size() - 1}};
        }
        Json material = {{"name", from.name}, {"pbrMetallicRoughness", std::move(pbr)}};
        material["emissiveTexture"] = {{"index", 0}, {"texCoord", 1}};
        material["emissiveFactor"] = {1.0, 1.0, 1.0};
        material["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = strength_;
        if (from.alpha_mask) material["alphaMode"] = "MASK", material["alphaCutoff"] = from.alpha_cutoff;
        if (from.alpha_blend) material["alphaMode"] = "BLEND";
        material["extras"] = {{"gonio_irradiance", "sum.exr"}, {"unit", "lx"}, {"texCoord", 1}};
        document_["materials"].push_back(std::move(material));
    }

    // A point of a side: barycentric in its triangle, and where it lies in the atlas.
    std::uint32_t corner(Corners& to, const Mesh& mesh, const PlacedSide& placed, const glm::dvec2& at) const {
        const std::array<glm::dvec2, 3> flat{placed.corner[0], placed.corner[1], placed.corner[2]};
        const glm::dvec2 w = barycentric(flat, at);
        const std::uint32_t* index = &mesh.indices[static_cast<std::size_t>(placed.side.triangle) * 3];
        const auto u = static_cast<float>(w.x), v = static_cast<float>(w.y);
        const auto mixed = [&](auto&& of) {
            return (1.0f - u - v) * of(index[0]) + u * of(index[1]) + v * of(index[2]);
        };
        to.positions.push_back(mixed([&](std::uint32_t i) { return mesh.vertices[i].position; }));
        const glm::vec3 normal = mixed([&](std::uint32_t i) { return mesh.vertices[i].normal; });
        const float length = std::max(glm::length(normal), 1e-20f);
        to.normals.push_back((placed.side.back ? -normal : normal) / length);
        to.uvs.push_back(mixed([&](std::uint32_t i) { return mesh.vertices[i].uv; }));
        to.map_uvs.emplace_back(at / glm::dvec2(layout_.atlas.width, layout_.atlas.height));
        if (!mesh.colors.empty())
            to.colors.emplace_back(mixed([&](std::uint32_t i) { return glm::vec4(mesh.colors[i]); }) + 0.5f);
        return static_cast<std::uint32_t>(to.positions.size() - 1);
    }

    void add(const Instance& instance, const std::vector<const PlacedSide*>& sides) {
        const Mesh& mesh = asset_.meshes[static_cast<std::size_t>(instance.mesh)];
        Corners to;
        std::map<std::tuple<std::uint32_t, int, bool>, std::uint32_t> shared;  // mesh vertex, sheet, back
        for (const PlacedSide* placed : sides) {
            const std::uint32_t* index = &mesh.indices[static_cast<std::size_t>(placed->side.triangle) * 3];
            if (placed->pieces.empty()) {
                std::uint32_t made[3];
                for (std::size_t k = 0; k < 3; ++k) {
                    const auto [at, fresh] = shared.try_emplace({index[k], placed->sheet, placed->side.back}, 0u);
                    if (fresh) at->second = corner(to, mesh, *placed, placed->corner[k]);
                    made[k] = at->second;
                }
                if (placed->side.back) std::swap(made[1], made[2]);
                to.indices.insert(to.indices.end(), made, made + 3);
                continue;
            }
            const auto turn = [](const glm::dvec2& a, const glm::dvec2& b) { return a.x * b.y - a.y * b.x; };
            // The pieces run as the map does: a mirrored one, and not a back, the other way round.
            const bool clockwise =
                turn(placed->corner[1] - placed->corner[0], placed->corner[2] - placed->corner[0]) < 0.0;
            for (const Polygon& piece : placed->pieces) {
                std::vector<std::uint32_t> made;
                for (const glm::dvec2& p : piece) made.push_back(corner(to, mesh, *placed, p));
                if (clockwise != placed->side.back) std::reverse(made.begin(), made.end());
                for (std::size_t k = 1; k + 1 < made.size(); ++k)
                    to.indices.insert(to.indices.end(), {made[0], made[k], made[k + 1]});
            }
        }
        glm::vec3 low(1e30f), high(-1e30f);
        for (const glm::vec3& p : to.positions) low = glm::min(low, p), high = glm::max(high, p);
        Json attributes = {
            {"POSITION", add_accessor(to.positions, kFloat, "VEC3",
                                      {{"min", {low.x, low.y, low.z}}, {"max", {high.x, high.y, high.z}}})},
            {"NORMAL", add_accessor(to.normals, kFloat, "VEC3")},
            {"TEXCOORD_0", add_accessor(to.uvs, kFloat, "VEC2")},
            {"TEXCOORD_1", add_accessor(to.map_uvs, kFloat, "VEC2")}};
        if (!to.colors.empty())
            attributes["COLOR_0"] = add_accessor(to.colors, kUnsignedShort, "VEC4", {{"normalized", true}});
        document_["meshes"].push_back(
            {{"primitives", Json::array({Json{{"attributes", std::move(attributes)},
                                              {"indices", add_accessor(to.indices, kUnsignedInt, "SCALAR")},
                                              {"material", mesh.material}}})}});
        Json matrix = Json::array();
        for (int i = 0; i < 16; ++i) matrix.push_back(instance.world_from_mesh[i / 4][i % 4]);
        document_["nodes"].push_back(
            {{"name", instance.node}, {"mesh", document_["meshes"].size() - 1}, {"matrix", std::move(matrix)}});
    }

    void add(const Camera& camera) {
        const glm::dvec3 back = glm::normalize(camera.eye - camera.target),
                         helper = std::abs(back.y) < 0.999 ? glm::dvec3(0, 1, 0) : glm::dvec3(0, 0, 1),
                         right = glm::normalize(glm::cross(helper, back)), up = glm::cross(back, right);
        document_["cameras"].push_back(
            {{"type", "perspective"}, {"perspective", {{"yfov", camera.fov_rad}, {"znear", 0.01}}}});
        const glm::dquat turn = glm::quat_cast(glm::dmat3(right, up, back));
        document_["nodes"].push_back({{"name", "camera"},
                                      {"camera", document_["cameras"].size() - 1},
                                      {"translation", {camera.eye.x, camera.eye.y, camera.eye.z}},
                                      {"rotation", {turn.x, turn.y, turn.z, turn.w}}});
    }

    const SceneAsset& asset_;
    const Layout& layout_;
    Json document_;
    std::string binary_;
    float strength_ = 1.0f;  // cd/m²
};

}  // namespace

Result<std::string> lit_glb(const SceneAsset& asset, const Layout& layout, std::span<const float> irradiance) {
    std::vector<float> albedo(3 * layout.atlas.texels.size()), emission(albedo.size());
    for (std::size_t i = 0; i < layout.atlas.texels.size(); ++i) {
        for (std::size_t c = 0; c < 3; ++c) {
            albedo[3 * i + c] = layout.atlas.texels[i].albedo[static_cast<int>(c)];
            emission[3 * i + c] = layout.atlas.texels[i].emission[static_cast<int>(c)];
        }
    }
    std::vector<float> luminance = picture_of(layout.atlas, layout.fill, albedo, 3);
    const std::vector<float> own = picture_of(layout.atlas, layout.fill, emission, 3);
    for (std::size_t p = 0; p < luminance.size(); ++p)
        luminance[p] = own[p] + luminance[p] * irradiance[p] / std::numbers::pi_v<float>;
    Writer writer(asset, layout);
    if (auto error = writer.run(luminance)) return *error;
    std::string bytes = writer.file();
    return bytes;
}

}  // namespace gonio::bake
