#include "server/shade/close_blocks.h"

#include <algorithm>

#include "server/shade/near_light.h"
#include "server/shade/occlusion.h"
#include "server/shade/point_packet.h"
#include "server/trace/sampler.h"
#include "server/trace/sources.h"

namespace gonio::shade {
namespace {

constexpr int kSide = Patch::kSide;  // grid points

// A block differs slightly if the square of its contrast over its mean is below this part of the picture's mean.
constexpr double kSlight = 0.01;

// The first of the list's subsets, each a stratified sample of the whole, that hold about so many VPLs.
std::span<const Vpl> first_subsets(const VplCast& cast, unsigned about) {
    const unsigned subsets = std::clamp(about / std::max(cast.per_subset, 1u), 1u, kSubsets);
    return std::span(cast.vpls).first(std::min(cast.vpls.size(), std::size_t{subsets} * cast.per_subset));
}

// Asks VPLs of the list, each as likely as it brings much. A VPL's number in the draw is its own for ever: as a
// luminaire glides, the choice changes by one VPL now and then.
void ask_by_share(const LightView& light, const Quality& quality, unsigned asked, VplQuery& query) {
    const std::span<const Vpl> vpls = first_subsets(light.vpls, quality.close.listed);
    static thread_local std::vector<float> brings, share;
    brings.resize(vpls.size() * kLanes);
    share.resize(vpls.size());
    terms(query.points(), glm::vec3(light.position), vpls, quality.kappa, brings.data());
    if (!shares(brings.data(), vpls.size(), share.data())) return;
    // Multiples of the golden ratio are even; from one half on none of them is so small that a VPL which brings next to
    // nothing were asked, and counted for all those like it.
    std::uint32_t drawn = 0x80000000u;
    for (std::size_t v = 0; v < vpls.size(); ++v, drawn += 0x9e3779b9u) {
        const float chance = std::min(1.0f, share[v] * static_cast<float>(asked));
        if (trace::unit_interval(drawn) < chance) query.ask(light, vpls[v], &brings[v * kLanes], 1.0f / chance);
    }
}

}  // namespace

std::vector<CloseBlock> choose_close_blocks(const Grid& grid, const Planes& light, const Close& close) {
    const int columns = (grid.width + kSide - 1) / kSide, first_row = close.from_row / kSide,
              end_row = (std::min(grid.height, close.to_row) + kSide - 1) / kSide;
    const auto most = static_cast<std::size_t>(close.share * static_cast<float>(columns * (end_row - first_row)));
    if (most == 0) return {};
    struct Block {
        double contrast;
        glm::ivec2 first;
    };
    std::vector<Block> found;
    double all = 0.0;
    int all_lit = 0;
    for (int row = first_row; row < end_row; ++row) {
        for (int column = 0; column < columns; ++column) {
            const glm::ivec2 first(column * kSide, row * kSide);
            double low = 0.0, high = 0.0, sum = 0.0;
            int lit = 0;
            for (int y = first.y; y < std::min(first.y + kSide, grid.height); ++y) {
                for (int x = first.x; x < std::min(first.x + kSide, grid.width); ++x) {
                    const auto at = static_cast<std::size_t>(grid.at(x, y));
                    if (!(grid.values[6][at] > 0.0f)) continue;
                    const double value = trace::luminance(glm::dvec3(light[0][at], light[1][at], light[2][at]));
                    low = lit == 0 ? value : std::min(low, value);
                    high = std::max(high, value);
                    sum += value;
                    ++lit;
                }
            }
            if (sum > 0.0) found.push_back({(high - low) * (high - low) * lit / sum, first});
            all += sum;
            all_lit += lit;
        }
    }
    const double least = kSlight * all / std::max(all_lit, 1);
    std::erase_if(found, [&](const Block& block) { return block.contrast <= least; });
    double cut = least;
    if (found.size() > most) {
        const auto next = found.begin() + static_cast<std::ptrdiff_t>(most);
        std::nth_element(found.begin(), next, found.end(),
                         [](const Block& a, const Block& b) { return a.contrast > b.contrast; });
        cut = next->contrast;
        found.resize(most);
    }
    const auto fade = static_cast<double>(close.fade);
    std::vector<CloseBlock> result;
    for (const Block& block : found)
        result.push_back(
            {block.first, static_cast<float>(std::min((block.contrast / cut - 1.0) / std::max(fade, 1e-6), 1.0))});
    return result;
}

namespace {

// Sixteen points, and what share of what is shown there becomes their own estimate.
struct Shared {
    Patch patch;
    float share;
};

// patch_of: number -> Shared, for so many. keep: what is shown stays where none of the VPLs asked could light a point.
template <typename PatchOf>
void light_patches(std::size_t number, const PatchOf& patch_of, unsigned asked, bool keep, const ScreenGrid& screen,
                   const LightView& light, Planes& out, Pool& pool) {
    if (number == 0) return;
    constexpr std::size_t kPoints = trace::kPacket, kTogether = 4;  // they share the loads of VPLs
    const Quality& quality = screen.quality;
    const unsigned near_rays = quality.near_rays > 0 ? quality.close.near_rays : 0;
    const std::vector<glm::vec3> directions = stratified_directions(near_rays, quality.round);
    const float per_ray = light.unit_m2 / static_cast<float>(std::max(near_rays, 1u));
    const std::span<const Vpl> summed = first_subsets(light.vpls, quality.close.summed);
    const float each = light.unit_m2 * static_cast<float>(kSubsets * light.vpls.per_subset) /
                       static_cast<float>(std::max<std::size_t>(summed.size(), 1));
    pool.run(static_cast<int>((number + kTogether - 1) / kTogether), [&](int job) {
        const std::size_t first = static_cast<std::size_t>(job) * kTogether,
                          count = std::min(kTogether, number - first);
        Shared shared[kTogether];
        alignas(64) float arrays[kArrays][kTogether * kPoints], rgb[3][kTogether * kPoints];
        for (std::size_t b = 0; b < count; ++b) {
            shared[b] = patch_of(first + b);
            for (int a = 0; a < kArrays; ++a)
                std::copy_n(shared[b].patch.points.array[a], kPoints, arrays[a] + b * kPoints);
        }
        gather({arrays[0], arrays[1], arrays[2], arrays[3], arrays[4], arrays[5]}, count * kPoints,
               glm::vec3(light.position), summed, quality.kappa, each, rgb[0], rgb[1], rgb[2]);
        for (std::size_t b = 0; b < count; ++b) {
            const auto& [patch, share] = shared[b];
            VplQuery query(patch.points.off(light.geometry), patch.active);
            if (quality.node_vpls > 0) ask_by_share(light, quality, asked, query);
            const NearSums near = near_light(light, patch.points.points(), patch.active, directions, quality.kappa);
            for (int i = 0; i < trace::kPacket; ++i) {
                const bool unknown = quality.node_vpls > 0 && !(query.open(i) > 0.0f);
                if ((patch.active >> i & 1u) == 0 || (unknown && keep)) continue;
                const std::size_t k = b * kPoints + static_cast<std::size_t>(i), to = patch.at[i];
                const float seen = query.seen(i), close[3] = {near.red[i], near.green[i], near.blue[i]};
                for (std::size_t c = 0; c < 3; ++c)
                    out[c][to] += share * (rgb[c][k] * seen + close[c] * per_ray - out[c][to]);
            }
        }
    });
}

}  // namespace

void light_close_blocks(const std::vector<CloseBlock>& blocks, const ScreenGrid& screen, const LightView& light,
                        Planes& out, Pool& pool) {
    light_patches(
        blocks.size(),
        [&](std::size_t i) {
            return Shared{patch_at(screen.grid, blocks[i].first.x, blocks[i].first.y), blocks[i].share};
        },
        screen.quality.close.asked, true, screen, light, out, pool);
}

void light_second_points(const ScreenGrid& screen, const LightView& light, Planes& out, Pool& pool) {
    light_patches(
        screen.second_packets.size(),
        [&](std::size_t i) {
            return Shared{screen.second_packets[i], 1.0f};
        },
        screen.quality.close.asked / 2, false, screen, light, out, pool);
}

}  // namespace gonio::shade
