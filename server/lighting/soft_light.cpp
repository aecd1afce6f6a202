#include "server/lighting/soft_light.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "server/lighting/direct.h"
#include "server/scene/opening_points.h"

namespace gonio::lighting {

std::shared_ptr<const SoftParts> soft_parts(const ies::Opening& opening, const glm::mat3& light_from_world, bool fine) {
    if (opening.shape == ies::OpeningShape::point || !(glm::length(half_sides(opening)) > 0.0)) return nullptr;
    const std::size_t most = fine ? 256 : 64;
    const glm::dmat3 world_from_light = glm::transpose(glm::dmat3(light_from_world));
    const auto placed = [&](const std::vector<glm::dvec3>& points, const glm::dvec3& off) {
        std::vector<glm::vec3> result;
        for (const glm::dvec3& point : points) result.emplace_back(world_from_light * (point + off));
        return result;
    };
    auto parts = std::make_shared<SoftParts>();
    constexpr unsigned kMostLevels = 9;  // each has twice as many parts along a side, and one at least
    for (unsigned level = 0; level < kMostLevels && (level == 0 || parts->levels.back().at.size() < most); ++level) {
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

glm::vec3 first_target(const DirectLight& light, unsigned first_point, const glm::vec3& position,
                       const glm::vec3& normal) {
    const std::vector<glm::vec3>& few = light.parts->few;
    for (unsigned i = 0; i < kFewPoints; ++i) {
        const glm::vec3 target = light.position + few[(first_point + 5 * i) % kFewPoints];
        if (glm::dot(normal, target - position) > 0.0f) return target;
    }
    return light.position + few[first_point];
}

namespace {

struct Asked {
    const trace::Geometry& geometry;
    const DirectLight& light;
    const GBuffer& gbuffer;
};

// Result: a point in the middle of an opening.
DirectLight middle_of(const DirectLight& light) {
    DirectLight middle = light;
    middle.parts = nullptr;
    return middle;
}

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

// Those of kFewPoints, Hammersley's, that a quarter of all points send rays to. Ray i goes to quarter i of the opening,
// so that rays of one packet go the same way; the four rays lie in different quarters of both of its sides. The four
// quarters together are all of them.
constexpr unsigned kQuarters = 4;
unsigned of_quarter(unsigned quarter, unsigned ray) {
    const unsigned right = ray >> 1, up = ray & 1;
    return right << 3 | ((quarter >> 1 ^ up) << 2) | (((quarter & 1) ^ right) << 1) | up;
}

// Four rays of each point, to a quarter. Adds the light that they bring, and what it would be if nothing were between.
void ask_quarters(const Asked& asked, const Points& points, const float* depth, unsigned active,
                  const unsigned* quarter, std::span<const glm::vec3> to, float* seen, float* all) {
    for (unsigned ray = 0; ray < kFewPoints / kQuarters; ++ray) {
        alignas(64) float shifted[6][trace::kPacket], arrives[trace::kPacket];
        glm::vec3 targets[trace::kPacket];
        for (int i = 0; i < trace::kPacket; ++i) {
            const glm::vec3& off = to[of_quarter(quarter[i], ray)];
            targets[i] = asked.light.position + off;
            shifted[0][i] = points.x[i] - off.x, shifted[1][i] = points.y[i] - off.y;
            shifted[2][i] = points.z[i] - off.z;
            shifted[3][i] = points.nx[i], shifted[4][i] = points.ny[i], shifted[5][i] = points.nz[i];
        }
        direct_points(asked.light, points_at(shifted, 0), trace::kPacket, arrives);
        unsigned lit = 0;
        for (int i = 0; i < trace::kPacket; ++i) lit |= (arrives[i] > 0.0f ? 1u : 0u) << i;
        float passed[trace::kPacket];
        ask(asked, points, depth, lit & active, passed, targets);
        for (int i = 0; i < trace::kPacket; ++i) {
            if ((active >> i & 1u) == 0) continue;
            seen[i] += arrives[i] * passed[i], all[i] += arrives[i];
        }
    }
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
    const DirectLight middle = middle_of(light);
    const Asked asked{geometry, middle, gbuffer};
    if (n > kFewPoints) {
        for (unsigned left = active; left != 0; left &= left - 1) {
            const int i = std::countr_zero(left);
            share[i] = share_of(asked, points, depth, i, light.parts->many);
        }
        return;
    }
    unsigned quarter[trace::kPacket];
    float seen[trace::kPacket] = {}, all[trace::kPacket] = {};
    for (const unsigned half : {0u, 2u}) {  // two quarters: neighbours send theirs to the other two
        for (unsigned i = 0; i < trace::kPacket; ++i) quarter[i] = half + (i & 1u);
        ask_quarters(asked, points, depth, active, quarter, light.parts->few, seen, all);
    }
    for (int i = 0; i < trace::kPacket; ++i)
        if ((active >> i & 1u) != 0) share[i] = all[i] > 0.0f ? seen[i] / all[i] : 0.0f;
}

void visible_among(const trace::Geometry& geometry, const DirectLight& light, const GBuffer& gbuffer,
                   const Points& points, const float* depth, int count, const unsigned* quarter, float* share) {
    constexpr float kReach_px = 4.5f;
    const DirectLight middle = middle_of(light);
    const Asked asked{geometry, middle, gbuffer};
    float seen[trace::kPacket] = {}, all[trace::kPacket] = {};
    ask_quarters(asked, points, depth, (1u << count) - 1u, quarter, light.parts->few, seen, all);
    unsigned beside[trace::kPacket], lone = 0;  // bits of points
    for (int i = 0; i < count; ++i) {
        const glm::vec3 p(points.x[i], points.y[i], points.z[i]), n(points.nx[i], points.ny[i], points.nz[i]);
        const float reach_m = kReach_px * depth[i] * gbuffer.depth_per_pixel;
        beside[i] = 0;
        for (int k = 0; k < count; ++k) {
            const glm::vec3 off = glm::vec3(points.x[k], points.y[k], points.z[k]) - p;
            const bool near = glm::dot(off, off) < reach_m * reach_m &&
                              glm::dot(n, glm::vec3(points.nx[k], points.ny[k], points.nz[k])) > 0.9f;
            beside[i] |= (near ? 1u : 0u) << k;
        }
        lone |= (std::popcount(beside[i]) < 3 ? 1u : 0u) << i;
    }
    if (lone != 0) {
        unsigned other[trace::kPacket];
        for (int i = 0; i < trace::kPacket; ++i) other[i] = quarter[i] ^ 3u;
        ask_quarters(asked, points, depth, lone, other, light.parts->few, seen, all);
    }
    for (int i = 0; i < count; ++i) {
        float own = 0.0f, most = 0.0f;
        for (unsigned left = beside[i]; left != 0; left &= left - 1) {
            const int k = std::countr_zero(left);
            own += seen[k], most += all[k];
        }
        share[i] = most > 0.0f ? own / most : 0.0f;
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

// Sixteen points of a grid, or fewer, that wait for rays.
struct Waiting {
    std::size_t at[trace::kPacket];
    unsigned quarter[trace::kPacket] = {};
    alignas(64) float values[7][trace::kPacket] = {};  // as of Points, and the depth
    int count = 0;
    void add(const Grid& grid, std::size_t point, unsigned of) {
        at[count] = point, quarter[count] = of;
        for (std::size_t v = 0; v < 7; ++v) values[v][count] = grid.values[v][point];
        ++count;
    }
    unsigned all() const { return (1u << count) - 1u; }
};

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
    // Result: bits of the nine points around and with it, row by row, that have first rays and lie on its surface.
    unsigned on_surface(int x, int y) const {
        const auto own = static_cast<std::size_t>(grid.at(x, y));
        const glm::vec3 p = grid.position(own), n = grid.normal(own);
        unsigned found = 1u << 4;
        for (int k = 0; k < 9; ++k) {
            const int column = x + k % 3 - 1, row = y + k / 3 - 1;
            if (column < 0 || row < 0 || column >= grid.width || row >= grid.height) continue;
            const auto other = static_cast<std::size_t>(grid.at(column, row));
            const glm::vec3 off = grid.position(other) - p;
            if (values[other] >= 0.0f && glm::dot(n, grid.normal(other)) >= 0.98f &&
                std::abs(glm::dot(n, off)) <= 0.1f * glm::length(off))
                found |= 1u << k;
        }
        return found;
    }
};

}  // namespace

void soften_grid(const GBuffer& gbuffer, const Grid& grid, const trace::Geometry& geometry, const DirectLight& light,
                 std::vector<float>& ratio, std::vector<float>& through, Pool* pool) {
    const std::vector<float> values = through;
    if (const FirstOfGrid first(grid, values); first.mixed()) {
        const auto each_row = [&](const auto& job) {
            if (pool != nullptr) pool->run(first.down, job);
            for (int row = 0; pool == nullptr && row < first.down; ++row) job(row);
        };
        const DirectLight middle = middle_of(light);
        const Asked asked{geometry, middle, gbuffer};
        std::vector<float> arrives(through.size(), -1.0f);     // from a point's quarter; negative: it has not asked it
        std::vector<std::uint16_t> around(through.size(), 0);  // of those: on_surface()
        each_row([&](int row) {
            Waiting alone, among;
            const auto ask_all = [&] {
                float share[trace::kPacket];
                visible_share(geometry, light, gbuffer, points_at(alone.values, 0), alone.values[6], alone.all(),
                              kFewPoints, share);
                for (int i = 0; i < alone.count; ++i) through[alone.at[i]] = share[i];
                alone.count = 0;
            };
            const auto ask_some = [&] {
                float seen[trace::kPacket] = {}, all[trace::kPacket] = {};
                ask_quarters(asked, points_at(among.values, 0), among.values[6], among.all(), among.quarter,
                             light.parts->few, seen, all);
                for (int i = 0; i < among.count; ++i) {
                    through[among.at[i]] = all[i] > 0.0f ? seen[i] / all[i] : 0.0f;
                    arrives[among.at[i]] = all[i];
                }
                among.count = 0;
            };
            constexpr int kBlock = FirstOfGrid::kBlock;
            for (int block = 0; block < first.across; ++block) {
                if (!first.block_mixed(block, row)) continue;
                for (int i = 0; i < kBlock * kBlock; ++i) {
                    const int x = block * kBlock + i % kBlock, y = row * kBlock + i / kBlock;
                    if (x >= grid.width || y >= grid.height || first.at(x, y) < 0.0f || !first.mixed(x, y)) continue;
                    const unsigned near = first.on_surface(x, y);
                    const bool few = std::popcount(near) > 4;
                    Waiting& waiting = few ? among : alone;
                    if (few) around[static_cast<std::size_t>(grid.at(x, y))] = static_cast<std::uint16_t>(near);
                    waiting.add(grid, static_cast<std::size_t>(grid.at(x, y)),
                                static_cast<unsigned>((y & 1) * 2 + (x & 1)));
                    if (waiting.count == trace::kPacket) few ? ask_some() : ask_all();
                }
            }
            if (alone.count > 0) ask_all();
            if (among.count > 0) ask_some();
        });
        // The points around one have asked the other quarters; all eight the three others as often as its own.
        const std::vector<float> shares = through;
        each_row([&](int row) {
            constexpr int kBlock = FirstOfGrid::kBlock;
            for (int y = row * kBlock; y < std::min((row + 1) * kBlock, grid.height); ++y)
                for (int x = 0; x < grid.width; ++x) {
                    const auto own = static_cast<std::size_t>(grid.at(x, y));
                    if (around[own] == 0) continue;
                    float seen = 0.0f, all = 0.0f;
                    for (unsigned left = around[own]; left != 0; left &= left - 1) {
                        const int k = std::countr_zero(left), u = k % 3 - 1, v = k / 3 - 1;
                        const auto at = static_cast<std::size_t>(grid.at(x + u, y + v));
                        const float weight = static_cast<float>((2 - std::abs(u)) * (2 - std::abs(v))) *
                                             (arrives[at] < 0.0f ? arrives[own] : arrives[at]);
                        seen += weight * shares[at], all += weight;
                    }
                    if (all > 0.0f) through[own] = seen / all;
                }
        });
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
