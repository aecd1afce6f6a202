#include "server/bake/glb.h"

#include <algorithm>
#include <map>
#include <numbers>

#include "ies/core/srgb.h"
#include "server/assets/assets.h"
#include "server/assets/glb_writer.h"

namespace gonio::bake {
namespace {

using Json = GlbWriter::Json;

constexpr double kBrighter = 0.001;  // share of texels that may be brighter than the texture shows

// One primitive's vertices.
struct Corners {
    std::vector<glm::vec3> positions, normals;
    std::vector<glm::vec2> uvs, map_uvs;
    std::vector<glm::u16vec4> colors;
    std::vector<std::uint32_t> indices;
};

class Writer {
public:
    Writer(const SceneAsset& asset, const Layout& layout) : asset_(asset), layout_(layout) {}

    std::optional<Error> run(std::span<const float> luminance) {
        if (auto error = add_map(luminance)) return error;
        for (const Image& image : asset_.images) {
            auto png = encode_rgba_png(image);
            if (!png) return png.error();
            glb_.add_image(*png);
            if (glb_.binary_bytes() > kMostGlbBytes) return too_large();
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
            if (glb_.binary_bytes() > kMostGlbBytes) return too_large();
        }
        for (const Camera& camera : asset_.cameras) glb_.add_camera(camera, "camera");
        glb_.document["extensionsUsed"] = {"KHR_materials_emissive_strength"};
        return std::nullopt;
    }

    std::string file() { return glb_.file(); }

private:
    static Error too_large() {
        return {"too_large", "bake.glb", std::to_string(kMostGlbBytes >> 20) + " MiB",
                "the scene with its map would be a larger file"};
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
        for (const float nit : luminance) picture.rgb.push_back(srgb_byte(static_cast<double>(nit / strength_)));
        const auto png = encode_png(picture);
        if (!png) return png.error();
        glb_.add_image(*png);
        glb_.add("samplers", {{"magFilter", 9729}, {"minFilter", 9729}, {"wrapS", 33071}, {"wrapT", 33071}});
        glb_.add("textures", {{"source", 0}, {"sampler", 0}});
        return std::nullopt;
    }

    void add(const Material& from) {
        int texture = -1;
        if (from.base_color_image >= 0)
            texture = static_cast<int>(
                glb_.add_texture(static_cast<std::size_t>(from.base_color_image) + 1, from.wrap_s, from.wrap_t));
        Json material = GlbWriter::material_of(from, texture);
        material["emissiveTexture"] = {{"index", 0}, {"texCoord", 1}};
        material["emissiveFactor"] = {1.0, 1.0, 1.0};
        material["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = strength_;
        material["extras"] = {{"gonio_irradiance", "sum.exr"}, {"unit", "lx"}, {"texCoord", 1}};
        glb_.add("materials", std::move(material));
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
        Json attributes = {{"POSITION", glb_.add_positions(to.positions)},
                           {"NORMAL", glb_.add_accessor(to.normals, GlbWriter::kFloat, "VEC3")},
                           {"TEXCOORD_0", glb_.add_accessor(to.uvs, GlbWriter::kFloat, "VEC2")},
                           {"TEXCOORD_1", glb_.add_accessor(to.map_uvs, GlbWriter::kFloat, "VEC2")}};
        if (!to.colors.empty())
            attributes["COLOR_0"] =
                glb_.add_accessor(to.colors, GlbWriter::kUnsignedShort, "VEC4", {{"normalized", true}});
        const std::size_t made = glb_.add(
            "meshes", {{"primitives",
                        Json::array({Json{{"attributes", std::move(attributes)},
                                          {"indices", glb_.add_accessor(to.indices, GlbWriter::kUnsignedInt, "SCALAR")},
                                          {"material", mesh.material}}})}});
        glb_.add("nodes",
                 {{"name", instance.node}, {"mesh", made}, {"matrix", GlbWriter::matrix_of(instance.world_from_mesh)}});
    }

    const SceneAsset& asset_;
    const Layout& layout_;
    GlbWriter glb_;
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
