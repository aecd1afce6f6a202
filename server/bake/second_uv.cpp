// An atlas that the scene's file lays out: glTF's second set of texture coordinates.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_map>

#include "server/bake/atlas.h"
#include "server/trace/parallel.h"

namespace gonio::bake {
namespace {

constexpr double kBeside = 1e-4;  // how far coordinates may leave 0..1

std::string place_of(const SceneAsset& asset, const Side& side) {
    const Instance& instance = asset.instances[static_cast<std::size_t>(side.instance)];
    return "triangle " + std::to_string(side.triangle) + " of instance " + std::to_string(side.instance) +
           (instance.node.empty() ? "" : " (" + instance.node + ")");
}

// Sides that share an edge in the map are of one sheet.
struct Islands {
    std::vector<int> parent;

    int root(int i) {
        while (parent[static_cast<std::size_t>(i)] != i)
            i = parent[static_cast<std::size_t>(i)] =
                parent[static_cast<std::size_t>(parent[static_cast<std::size_t>(i)])];
        return i;
    }
    void join(int a, int b) {
        const int ra = root(a), rb = root(b);
        parent[static_cast<std::size_t>(std::max(ra, rb))] = std::min(ra, rb);
    }
};

}  // namespace

Result<Atlas> second_uv_atlas(const trace::Geometry& geometry, const AtlasSettings& settings) {
    const SceneAsset& asset = geometry.asset();
    const glm::dvec2 size(settings.width, settings.height);
    Sheet all;  // every side, in texels of the atlas; mirrored ones run clockwise
    all.size = {settings.width, settings.height};
    Islands islands;
    std::vector<double> turn;
    for (std::size_t i = 0; i < asset.instances.size(); ++i) {
        const Mesh& mesh = asset.meshes[static_cast<std::size_t>(asset.instances[i].mesh)];
        if (mesh.second_uv.empty())
            return Error{"no_second_uv", "bake.uv", asset.instances[i].node,
                         "a mesh has no second set of texture coordinates (TEXCOORD_1)"};
        const std::vector<int> weld = welded(geometry, static_cast<int>(i));
        std::unordered_map<std::uint64_t, std::vector<std::pair<int, int>>> edges;  // side, corner
        for (std::size_t t = 0; t < mesh.indices.size() / 3; ++t) {
            const Side side{static_cast<int>(i), static_cast<int>(t), false};
            const auto corner = corners_of(geometry, side);
            const double m2 = 0.5 * glm::length(glm::cross(corner[1] - corner[0], corner[2] - corner[0]));
            auto flat = std::array<glm::dvec2, 3>{};
            for (std::size_t k = 0; k < 3; ++k) {
                const glm::dvec2 uv(mesh.second_uv[mesh.indices[3 * t + k]]);
                if (!(uv.x > -kBeside && uv.y > -kBeside && uv.x < 1.0 + kBeside && uv.y < 1.0 + kBeside))
                    return Error{"overlapping_uv", "bake.uv", place_of(asset, side),
                                 "a texture coordinate of the second set lies outside 0 to 1"};
                flat[k] = glm::clamp(uv, 0.0, 1.0) * size;
            }
            const double texels = area_of(Polygon(flat.begin(), flat.end()));
            if (!(m2 > 0.0)) continue;
            if (!(std::abs(texels) > 1e-9))
                return Error{"overlapping_uv", "bake.uv", place_of(asset, side),
                             "a triangle has no area in the second set of texture coordinates"};
            const auto number = static_cast<int>(all.sides.size());
            all.sides.push_back(side);
            all.flat.push_back(flat);
            all.m2_per_texel.push_back(m2 / std::abs(texels));
            turn.push_back(texels);
            Polygon outline(flat.begin(), flat.end());
            if (texels < 0.0) std::reverse(outline.begin(), outline.end());
            all.pieces.push_back({number, std::move(outline)});
            islands.parent.push_back(number);
            for (int k = 0; k < 3; ++k) {
                const auto a = static_cast<std::uint32_t>(weld[mesh.indices[3 * t + static_cast<std::size_t>(k)]]),
                           b = static_cast<std::uint32_t>(
                               weld[mesh.indices[3 * t + static_cast<std::size_t>((k + 1) % 3)]]);
                auto& shared = edges[static_cast<std::uint64_t>(std::min(a, b)) << 32 | std::max(a, b)];
                for (const auto& [other, j] : shared) {
                    const auto& theirs = all.flat[static_cast<std::size_t>(other)];
                    const glm::dvec2 p = flat[static_cast<std::size_t>(k)],
                                     q = flat[static_cast<std::size_t>((k + 1) % 3)],
                                     r = theirs[static_cast<std::size_t>(j)],
                                     s = theirs[static_cast<std::size_t>((j + 1) % 3)];
                    const double apart =
                        std::min(glm::length(p - r) + glm::length(q - s), glm::length(p - s) + glm::length(q - r));
                    if (apart < 1e-3) islands.join(number, other);
                }
                shared.emplace_back(number, k);
            }
        }
    }
    // Who owns each texel centre.
    std::vector<std::int32_t> owner(
        static_cast<std::size_t>(settings.width) * static_cast<std::size_t>(settings.height), -1);
    for (std::size_t i = 0; i < all.sides.size(); ++i) {
        const auto& flat = all.flat[i];
        const glm::dvec2 low = glm::min(glm::min(flat[0], flat[1]), flat[2]),
                         high = glm::max(glm::max(flat[0], flat[1]), flat[2]);
        for (int y = std::max(0, static_cast<int>(low.y));
             y < std::min(settings.height, static_cast<int>(std::ceil(high.y))); ++y) {
            for (int x = std::max(0, static_cast<int>(low.x));
                 x < std::min(settings.width, static_cast<int>(std::ceil(high.x))); ++x) {
                const glm::dvec2 p(x + 0.5, y + 0.5);
                bool inside = true;
                for (std::size_t k = 0; k < 3 && inside; ++k) {
                    const glm::dvec2 edge = flat[(k + 1) % 3] - flat[k], to = p - flat[k];
                    inside = (edge.x * to.y - edge.y * to.x) * turn[i] > 1e-9 * std::abs(turn[i]);
                }
                if (!inside) continue;
                std::int32_t& at = owner[static_cast<std::size_t>(y) * static_cast<std::size_t>(settings.width) +
                                         static_cast<std::size_t>(x)];
                if (at >= 0)
                    return Error{"overlapping_uv", "bake.uv",
                                 place_of(asset, all.sides[static_cast<std::size_t>(at)]) + " and " +
                                     place_of(asset, all.sides[i]),
                                 "two triangles own the same texel of the second set of texture coordinates"};
                at = static_cast<std::int32_t>(i);
            }
        }
    }
    // One sheet for each island, in the order of its first side.
    std::vector<int> sheet_of_root(all.sides.size(), -1);
    std::vector<Sheet> sheets;
    for (std::size_t i = 0; i < all.sides.size(); ++i) {
        int& number = sheet_of_root[static_cast<std::size_t>(islands.root(static_cast<int>(i)))];
        if (number < 0) number = static_cast<int>(sheets.size()), sheets.emplace_back().size = all.size;
        Sheet& sheet = sheets[static_cast<std::size_t>(number)];
        sheet.pieces.push_back({static_cast<int>(sheet.sides.size()), all.pieces[i].outline});
        sheet.sides.push_back(all.sides[i]);
        sheet.flat.push_back(all.flat[i]);
        sheet.m2_per_texel.push_back(all.m2_per_texel[i]);
    }
    Atlas atlas;
    atlas.width = settings.width, atlas.height = settings.height;
    atlas.texel_at.assign(owner.size(), -1);
    for (Sheet& sheet : sheets) {  // around its own texels: covering the whole atlas for each would take long
        glm::dvec2 low(1e300), high(-1e300);
        for (const auto& flat : sheet.flat) {
            for (const glm::dvec2& p : flat) low = glm::min(low, p), high = glm::max(high, p);
        }
        const glm::ivec2 from(glm::floor(low));
        sheet.size = glm::max(glm::ivec2(glm::ceil(high)) - from, glm::ivec2(1));
        for (auto& flat : sheet.flat) {
            for (glm::dvec2& p : flat) p -= glm::dvec2(from);
        }
        for (Piece& piece : sheet.pieces) {
            for (glm::dvec2& p : piece.outline) p -= glm::dvec2(from);
        }
        place_sheet(atlas, geometry, sheet, from);
    }
    atlas.index_sides(asset);
    find_seams(atlas, geometry);
    return atlas;
}

}  // namespace gonio::bake
