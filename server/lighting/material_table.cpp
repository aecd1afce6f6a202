#include "server/lighting/material_table.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "server/lighting/packed_normal.h"
#include "server/trace/texture.h"

namespace gonio::lighting {
namespace {

// Linear rgb of an image's texels, or values in 0..1.
struct Level {
    int width = 0, height = 0;
    std::vector<glm::vec3> rgb;
    const glm::vec3& at(int x, int y) const {
        return rgb[static_cast<std::size_t>(std::min(y, height - 1)) * static_cast<std::size_t>(width) +
                   static_cast<std::size_t>(std::min(x, width - 1))];
    }
};

Level linear(const Image& image) {
    Level level{image.width_px, image.height_px, {}};
    for (std::size_t i = 0; i < image.rgba.size() && image.linear; i += 4)
        level.rgb.push_back(glm::vec3(image.rgba[i], image.rgba[i + 1], image.rgba[i + 2]) / 255.0f);
    for (std::size_t i = 0; i < image.rgba.size() && !image.linear; i += 4)
        level.rgb.emplace_back(trace::srgb_decode(image.rgba[i]), trace::srgb_decode(image.rgba[i + 1]),
                               trace::srgb_decode(image.rgba[i + 2]));
    return level;
}

Level halved(const Level& level) {
    Level half{std::max(1, level.width / 2), std::max(1, level.height / 2), {}};
    for (int y = 0; y < half.height; ++y) {
        for (int x = 0; x < half.width; ++x)
            half.rgb.push_back(0.25f * (level.at(2 * x, 2 * y) + level.at(2 * x + 1, 2 * y) +
                                        level.at(2 * x, 2 * y + 1) + level.at(2 * x + 1, 2 * y + 1)));
    }
    return half;
}

void add_texels(const Level& level, std::vector<std::uint32_t>& texels) {
    const auto part = [](float x, float most) {
        return static_cast<std::uint32_t>(std::lround(most * std::sqrt(std::clamp(x, 0.0f, 1.0f))));
    };
    for (const glm::vec3& c : level.rgb)
        texels.push_back(part(c.r, 2047.0f) | part(c.g, 2047.0f) << 11 | part(c.b, 1023.0f) << 22);
}

struct Builder {
    const SceneAsset& asset;
    MaterialTable result{};
    const bool colored =
        std::any_of(asset.meshes.begin(), asset.meshes.end(), [](const Mesh& mesh) { return !mesh.colors.empty(); });
    const bool mapped =
        std::any_of(asset.meshes.begin(), asset.meshes.end(), [](const Mesh& mesh) { return !mesh.tangents.empty(); });
    std::map<int, MaterialTable::Texture> images{};  // its levels, by image

    // Result: index of the texture that shows `image` as `material` repeats it, -1: none.
    std::int32_t texture_of(const Material& material, int image) {
        if (image < 0) return -1;
        if (!images.contains(image)) {
            Level level = linear(asset.images[static_cast<std::size_t>(image)]);
            while (std::max(level.width, level.height) >= 1 << kLevels) level = halved(level);
            MaterialTable::Texture texture{level.width, level.height, 0, 0, -1, {}, {}};
            do {
                if (texture.last_level >= 0) level = halved(level);
                texture.first_texel[++texture.last_level] = static_cast<std::int32_t>(result.texels.size());
                add_texels(level, result.texels);
            } while (level.width > 1 || level.height > 1);
            images[image] = texture;
        }
        MaterialTable::Texture texture = images[image];
        texture.wrap_s = static_cast<std::int32_t>(material.wrap_s);
        texture.wrap_t = static_cast<std::int32_t>(material.wrap_t);
        result.textures.push_back(texture);
        return static_cast<std::int32_t>(result.textures.size()) - 1;
    }

    void add_instance(const Instance& instance, std::span<const glm::vec3> positions) {
        const Mesh& mesh = asset.meshes[static_cast<std::size_t>(instance.mesh)];
        result.first_triangle.push_back(static_cast<std::uint32_t>(result.triangles.size()));
        const glm::dmat3 turn(instance.world_from_mesh);
        const glm::dmat3 cofactor(glm::cross(turn[1], turn[2]), glm::cross(turn[2], turn[0]),
                                  glm::cross(turn[0], turn[1]));
        std::vector<glm::vec3> normals;  // zero where degenerate
        for (const Vertex& vertex : mesh.vertices) {
            const glm::dvec3 n = cofactor * glm::dvec3(vertex.normal);
            const double length = glm::length(n);
            normals.push_back(length > 1e-300 ? glm::vec3(n / length) : glm::vec3(0.0f));
        }
        for (std::size_t t = 0; t < mesh.indices.size() / 3; ++t) {
            const std::uint32_t* own_indices = &mesh.indices[3 * t];
            const glm::vec3 corner = positions[own_indices[0]];
            const glm::vec3 cross = glm::cross(positions[own_indices[1]] - corner, positions[own_indices[2]] - corner);
            const float twice_area = glm::length(cross);
            const glm::vec3 own = twice_area > 0.0f ? cross / twice_area : glm::vec3(0.0f, 0.0f, 1.0f);
            MaterialTable::Triangle look;
            MaterialTable::TriangleUv on_texture;
            for (std::size_t k = 0; k < 3; ++k) {
                const std::uint32_t vertex = mesh.indices[3 * t + k];
                look.normal[k] = pack_normal(normals[vertex] != glm::vec3(0.0f) ? normals[vertex] : own);
                on_texture.uv[k] = mesh.vertices[vertex].uv;
            }
            look.material = static_cast<std::uint32_t>(mesh.material);
            result.triangles.push_back(look);
            if (colored) {
                MaterialTable::VertexColors& colors = result.colors.emplace_back();
                for (std::size_t k = 0; k < 3; ++k)
                    colors.corner[k] = mesh.colors.empty() ? glm::u16vec4(65535) : mesh.colors[mesh.indices[3 * t + k]];
            }
            if (mapped) {
                MaterialTable::Tangents& tangents = result.tangents.emplace_back();
                for (std::size_t k = 0; k < 3 && !mesh.tangents.empty(); ++k) {
                    const glm::vec4& tangent = mesh.tangents[mesh.indices[3 * t + k]];
                    const glm::dvec3 along = turn * glm::dvec3(tangent);
                    const double length = glm::length(along);
                    if (length > 1e-300)
                        tangents.tangent[k] = pack_normal(glm::vec3(along / length)), tangents.side = tangent.w;
                }
            }
            if (asset.images.empty()) continue;
            const glm::mat2 sides(on_texture.uv[1] - on_texture.uv[0], on_texture.uv[2] - on_texture.uv[0]);
            on_texture.uv_per_m = std::sqrt(std::abs(glm::determinant(sides)) / std::max(twice_area, 1e-30f));
            result.uv.push_back(on_texture);
        }
    }
};

}  // namespace

MaterialTable make_material_table(const SceneAsset& asset, const PositionsOf& positions) {
    Builder builder{asset};
    builder.result.asset = &asset;
    builder.result.triangles.reserve(asset.triangles());
    for (std::size_t i = 0; i < asset.instances.size(); ++i) builder.add_instance(asset.instances[i], positions(i));
    for (const Material& material : asset.materials) {
        builder.result.materials.push_back(
            {glm::vec3(material.base_color), builder.texture_of(material, material.base_color_image),
             material.emissive_nit, builder.texture_of(material, material.emissive_image)});
    }
    for (std::size_t i = 0; i < asset.materials.size() && builder.mapped; ++i)
        builder.result.normal_maps.push_back(
            {builder.texture_of(asset.materials[i], asset.materials[i].normal_image), asset.materials[i].normal_scale});
    const auto dark_back = [](const Material& material) {
        return material.show_back && !material.double_sided && material.emissive_nit != glm::vec3(0.0f);
    };
    if (std::any_of(asset.materials.begin(), asset.materials.end(), dark_back)) {
        for (const Material& material : asset.materials)
            builder.result.dark_backs.push_back(dark_back(material) ? 1 : 0);
    }
    return std::move(builder.result);
}

MaterialTable make_material_table(const trace::Geometry& geometry) {
    return make_material_table(geometry.asset(),
                               [&](std::size_t instance) { return geometry.positions(static_cast<int>(instance)); });
}

}  // namespace gonio::lighting
