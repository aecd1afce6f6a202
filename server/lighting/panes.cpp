#include "server/lighting/panes.h"

#include <algorithm>

#include "shaders/lib/as_cpp.h"

namespace gonio::lighting {
namespace {

// A triangle's base colour, its texture's at full detail, and where it lies on it.
glm::vec4 base_color_at(const MaterialTable& material_table, std::uint32_t triangle, float corner1, float corner2,
                        glm::vec2& at) {
    const Material& material = material_table.asset->materials[material_table.triangles[triangle].material];
    glm::vec4 color = material.base_color;
    if (!material_table.colors.empty()) {
        const glm::u16vec4* own = material_table.colors[triangle].corner;
        color *= ((1.0f - corner1 - corner2) * glm::vec4(own[0]) + corner1 * glm::vec4(own[1]) +
                  corner2 * glm::vec4(own[2])) /
                 65535.0f;
    }
    if (material_table.uv.empty()) return color;
    const glm::vec2* uv = material_table.uv[triangle].uv;
    at = (1.0f - corner1 - corner2) * uv[0] + corner1 * uv[1] + corner2 * uv[2];
    return trace::textured(*material_table.asset, material, color, material.base_color_image, at);
}

}  // namespace

std::optional<trace::Transparency> transparency_at(const MaterialTable& material_table, std::uint32_t triangle,
                                                   float corner1, float corner2) {
    const Material& material = material_table.asset->materials[material_table.triangles[triangle].material];
    glm::vec2 uv(0.0f);
    const glm::vec4 color = base_color_at(material_table, triangle, corner1, corner2, uv);
    if (material.alpha_mask && color.a < material.alpha_cutoff) return std::nullopt;
    if (!material.transmissive()) return trace::Transparency{};
    return trace::transparency_of(*material_table.asset, material, color, uv);
}

float pane_threshold(const MaterialTable& material_table, std::uint32_t triangle, const PaneSample& sample) {
    if (sample.index < 0) return glsl::pass_threshold(0, -1);
    const std::vector<std::uint32_t>& first = material_table.first_triangle;
    const auto instance =
        static_cast<std::uint32_t>(std::upper_bound(first.begin(), first.end(), triangle) - first.begin());
    const int parts = std::max(1, sample.count / 16);
    const float dither = glsl::display_dither(sample.x, sample.y) * 255.0f + 0.5f;
    const float within = (static_cast<float>(sample.index % parts) + dither) / static_cast<float>(parts);
    return glsl::pass_threshold(2 * instance + (sample.back ? 1 : 0), sample.index * 16 / sample.count) +
           (within - 0.5f) / 16.0f;
}

bool is_hole(const MaterialTable& material_table, std::uint32_t triangle, float corner1, float corner2,
             const PaneSample& sample) {
    const auto pane = transparency_at(material_table, triangle, corner1, corner2);
    return !pane || pane_threshold(material_table, triangle, sample) < pane->share;
}

bool any_pane(const MaterialTable& material_table) {
    return std::any_of(material_table.asset->materials.begin(), material_table.asset->materials.end(),
                       [](const Material& material) { return material.transmissive(); });
}

}  // namespace gonio::lighting
