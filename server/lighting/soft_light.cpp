#include "server/lighting/soft_light.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "server/lighting/direct.h"
#include "server/scene/opening_points.h"

namespace gonio::lighting {

std::shared_ptr<const SoftParts> soft_parts(const ies::Opening& opening, const glm::mat3& light_from_world, bool fine) {
    if (opening.shape == ies::OpeningShape::point) return nullptr;
    const std::size_t most = fine ? 256 : 64;
    const glm::dmat3 world_from_light = glm::transpose(glm::dmat3(light_from_world));
    const auto placed = [&](const std::vector<glm::dvec3>& points, const glm::dvec3& off) {
        std::vector<glm::vec3> result;
        for (const glm::dvec3& point : points) result.emplace_back(world_from_light * (point + off));
        return result;
    };
    auto parts = std::make_shared<SoftParts>();
    for (unsigned level = 0; level == 0 || parts->levels.back().at.size() < most; ++level) {
        const OpeningParts own = opening_parts(opening, level);
        if (own.points.size() > most) break;
        parts->levels.push_back({static_cast<float>(own.size_m), placed(own.points, glm::dvec3(0.0))});
    }
    parts->half_m = glm::vec3(half_sides(opening));
    parts->radius_m = glm::length(parts->half_m);
    const float least_m = parts->levels.back().size_m;
    parts->least_d2 = std::max(least_m * least_m / 3.0f, 1e-12f);
    parts->few = placed(opening_spread(opening, kFewPoints), lifted_off(opening));
    if (fine) parts->many = placed(opening_spread(opening, kManyPoints), lifted_off(opening));
    return parts;
}

namespace {

struct Asked {
    const trace::Geometry& geometry;
    const DirectLight& light;
    const GBuffer& gbuffer;
};

// Bits and shares of points that see a luminaire, where `active`. targets: as of unhidden().
void ask(const Asked& asked, const Points& points, const float* depth, unsigned active, float* passed,
         const glm::vec3* targets) {
    std::fill_n(passed, trace::kPacket, 1.0f);
    const unsigned seen =
        active != 0 ? unhidden(asked.geometry, asked.light, asked.gbuffer, points, depth, active, passed, targets) : 0u;
    for (int i = 0; i < trace::kPacket; ++i) passed[i] = (seen >> i & 1u) != 0 ? passed[i] : 0.0f;
}

// Result: what one point sees, by a ray to each of `to`, whole packets. asked.light: a point in the opening's middle:
// light from another of its points comes to the point as from there to one that is shifted.
float share_of(const Asked& asked, const Points& points, const float* depth, int i, std::span<const glm::vec3> to) {
    float seen = 0.0f, all = 0.0f;
    alignas(64) float values[6][trace::kPacket], shifted[6][trace::kPacket], depths[trace::kPacket];
    const float at[6] = {points.x[i], points.y[i], points.z[i], points.nx[i], points.ny[i], points.nz[i]};
    for (int v = 0; v < 6; ++v) {
        std::fill_n(values[v], trace::kPacket, at[v]);
        std::fill_n(shifted[v], trace::kPacket, at[v]);
    }
    std::fill_n(depths, trace::kPacket, depth[i]);
    for (std::size_t first = 0; first < to.size(); first += trace::kPacket) {
        glm::vec3 targets[trace::kPacket];
        for (int k = 0; k < trace::kPacket; ++k) {
            const glm::vec3& off = to[first + static_cast<std::size_t>(k)];
            targets[k] = asked.light.position + off;
            for (int v = 0; v < 3; ++v) shifted[v][k] = at[v] - off[v];
        }
        alignas(64) float arrives[trace::kPacket];
        direct_points(asked.light, points_at(shifted, 0), trace::kPacket, arrives);
        unsigned lit = 0;
        for (int k = 0; k < trace::kPacket; ++k) lit |= (arrives[k] > 0.0f ? 1u : 0u) << k;
        float passed[trace::kPacket];
        ask(asked, points_at(values, 0), depths, lit, passed, targets);
        for (int k = 0; k < trace::kPacket; ++k) seen += arrives[k] * passed[k], all += arrives[k];
    }
    return all > 0.0f ? seen / all : 0.0f;
}

// Those of kFewPoints that are nearest to the corners.
constexpr std::uint8_t kFirst[] = {0, 15, 3, 12};

// Result: bits of points to whom the first few rays do not say the same; share: of the others.
unsigned ask_corners(const Asked& asked, const Points& points, const float* depth, unsigned active,
                     std::span<const glm::vec3> to, float* share) {
    unsigned hidden = active, seen = active;  // so say all so far
    for (const std::uint8_t k : kFirst) {
        glm::vec3 targets[trace::kPacket];
        std::fill_n(targets, trace::kPacket, asked.light.position + to[k]);
        float passed[trace::kPacket];
        ask(asked, points, depth, active, passed, targets);
        for (int i = 0; i < trace::kPacket; ++i) {
            if (passed[i] > 0.0f) hidden &= ~(1u << i);
            if (passed[i] < 1.0f) seen &= ~(1u << i);
        }
    }
    for (int i = 0; i < trace::kPacket; ++i)
        if (((hidden | seen) >> i & 1u) != 0) share[i] = (seen >> i & 1u) != 0 ? 1.0f : 0.0f;
    return active & ~(hidden | seen);
}

}  // namespace

void visible_share(const trace::Geometry& geometry, const DirectLight& light, const GBuffer& gbuffer,
                   const Points& points, const float* depth, unsigned active, unsigned n, float* share) {
    if (!light.parts) {
        float passed[trace::kPacket];
        ask({geometry, light, gbuffer}, points, depth, active, passed, nullptr);
        for (int i = 0; i < trace::kPacket; ++i)
            if ((active >> i & 1u) != 0) share[i] = passed[i];
        return;
    }
    const std::span<const glm::vec3> to = light.parts->points(n);
    DirectLight middle = light;
    middle.parts = nullptr;
    const Asked asked{geometry, middle, gbuffer};
    const bool few = to.size() == kFewPoints && std::popcount(active) > static_cast<int>(std::size(kFirst));
    unsigned left = few ? ask_corners(asked, points, depth, active, to, share) : active;
    for (; left != 0; left &= left - 1) {
        const int i = std::countr_zero(left);
        share[i] = share_of(asked, points, depth, i, to);
    }
}

FirstRay around_first(const std::vector<std::uint8_t>& first, std::size_t row_length, int height, int x, int y) {
    unsigned met = 0;  // bit i: FirstRay i
    const auto column = static_cast<std::size_t>(std::max(x - 2, 0)),
               end = std::min(static_cast<std::size_t>(x) + 3, row_length);
    for (int row = std::max(y - 2, 0); row < std::min(y + 3, height); ++row)
        for (std::size_t at = column; at < end; ++at)
            met |= 1u << first[static_cast<std::size_t>(row) * row_length + at];
    const unsigned seen = 1u << static_cast<unsigned>(FirstRay::seen),
                   hidden = 1u << static_cast<unsigned>(FirstRay::hidden);
    met &= ~1u;
    return met == seen ? FirstRay::seen : met == hidden ? FirstRay::hidden : FirstRay::dimmed;
}

FirstRay around_grid(const Grid& grid, const std::vector<float>& through, int x, int y) {
    const auto before = [](int at) { return (at + kStep / 2) / kStep - 1; };  // point i stands at pixel 4i + 2
    float least = 1.0f, greatest = 0.0f;
    for (const int i : {0, 1})
        for (const int j : {0, 1}) {
            const float value = through[static_cast<std::size_t>(grid.at(before(x) + i, before(y) + j))];
            least = std::min(least, value), greatest = std::max(greatest, value);
        }
    return least >= 1.0f ? FirstRay::seen : greatest <= 0.0f ? FirstRay::hidden : FirstRay::dimmed;
}

namespace {

// What first rays say in a part of a grid.
struct Range {
    float least = 1.0f, greatest = 0.0f;
    void add(float value) {
        if (value < 0.0f) return;  // it has none
        least = std::min(least, value), greatest = std::max(greatest, value);
    }
    void add(const Range& other) {
        least = std::min(least, other.least), greatest = std::max(greatest, other.greatest);
    }
    bool mixed() const { return greatest - least > 0.05f; }
};

// The first rays of a grid's points to one opening, and those of blocks of 8 × 8.
struct FirstOfGrid {
    static constexpr int kBlock = 8;
    const Grid& grid;
    const std::vector<float>& values;
    int across, down;
    std::vector<Range> blocks;

    FirstOfGrid(const Grid& g, const std::vector<float>& of)
        : grid(g),
          values(of),
          across((g.width + kBlock - 1) / kBlock),
          down((g.height + kBlock - 1) / kBlock),
          blocks(static_cast<std::size_t>(across) * static_cast<std::size_t>(down)) {
        for (int y = 0; y < g.height; ++y)
            for (int x = 0; x < g.width; ++x) blocks[block(x / kBlock, y / kBlock)].add(at(x, y));
    }
    std::size_t block(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(across) + static_cast<std::size_t>(x);
    }
    float at(int x, int y) const { return values[static_cast<std::size_t>(grid.at(x, y))]; }
    bool mixed() const {
        Range all;
        for (const Range& own : blocks) all.add(own);
        return all.mixed();
    }
    // Whether a block's points, or those around it, do not all say the same.
    bool block_mixed(int x, int y) const {
        Range all;
        for (int row = std::max(y - 1, 0); row < std::min(y + 2, down); ++row)
            for (int column = std::max(x - 1, 0); column < std::min(x + 2, across); ++column)
                all.add(blocks[block(column, row)]);
        return all.mixed();
    }
    // Whether a point's and those two around it do not.
    bool mixed(int x, int y) const {
        Range all;
        for (int row = std::max(y - 2, 0); row < std::min(y + 3, grid.height); ++row)
            for (int column = std::max(x - 2, 0); column < std::min(x + 3, grid.width); ++column)
                all.add(at(column, row));
        return all.mixed();
    }
};

}  // namespace

void soften_grid(const GBuffer& gbuffer, const Grid& grid, const trace::Geometry& geometry, const DirectLight& light,
                 std::vector<float>& ratio, std::vector<float>& through, Pool* pool) {
    const std::vector<float> values = through;
    if (const FirstOfGrid first(grid, values); first.mixed()) {
        const auto job = [&](int row) {
            std::size_t at[trace::kPacket];
            alignas(64) float points[7][trace::kPacket] = {};
            int waiting = 0;
            const auto send = [&] {
                float share[trace::kPacket];
                visible_share(geometry, light, gbuffer, points_at(points, 0), points[6], (1u << waiting) - 1u,
                              kFewPoints, share);
                for (int i = 0; i < waiting; ++i) through[at[i]] = share[i];
                waiting = 0;
            };
            constexpr int kBlock = FirstOfGrid::kBlock;
            for (int block = 0; block < first.across; ++block) {
                if (!first.block_mixed(block, row)) continue;
                for (int i = 0; i < kBlock * kBlock; ++i) {
                    const int x = block * kBlock + i % kBlock, y = row * kBlock + i / kBlock;
                    if (x >= grid.width || y >= grid.height || first.at(x, y) < 0.0f || !first.mixed(x, y)) continue;
                    at[waiting] = static_cast<std::size_t>(grid.at(x, y));
                    for (std::size_t v = 0; v < 7; ++v) points[v][waiting] = grid.values[v][at[waiting]];
                    if (++waiting == trace::kPacket) send();
                }
            }
            if (waiting > 0) send();
        };
        if (pool != nullptr) pool->run(first.down, job);
        for (int row = 0; pool == nullptr && row < first.down; ++row) job(row);
    }
    for (int y = 0; y < grid.height; ++y) {
        for (auto own = static_cast<std::size_t>(grid.at(0, y)), end = own + static_cast<std::size_t>(grid.width);
             own < end; ++own) {
            if (through[own] < 0.0f)
                through[own] = 1.0f;  // it does not tell
            else
                ratio[own] = through[own] > 0.0f ? std::abs(ratio[own]) : -std::abs(ratio[own]);
        }
    }
}

}  // namespace gonio::lighting
