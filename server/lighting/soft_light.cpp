#include "server/lighting/soft_light.h"

#include <algorithm>
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

void visible_share(const trace::Geometry& geometry, const DirectLight& light, const GBuffer& gbuffer,
                   const Points& points, const float* depth, unsigned active, unsigned n, float* share) {
    float passed[trace::kPacket];
    const auto ask = [&](const DirectLight& point, unsigned which) {
        std::fill_n(passed, trace::kPacket, 1.0f);
        const unsigned seen = which != 0 ? unhidden(geometry, point, gbuffer, points, depth, which, passed) : 0u;
        for (int i = 0; i < trace::kPacket; ++i) passed[i] = (seen >> i & 1u) != 0 ? passed[i] : 0.0f;
    };
    if (!light.parts) {
        ask(light, active);
        for (int i = 0; i < trace::kPacket; ++i)
            if ((active >> i & 1u) != 0) share[i] = passed[i];
        return;
    }
    // The first four are those nearest to the corners.
    constexpr std::uint8_t kOrder[kFewPoints] = {0, 15, 3, 12, 1, 2, 4, 5, 6, 7, 8, 9, 10, 11, 13, 14};
    constexpr unsigned kFirst = 4;
    const std::span<const glm::vec3> to = light.parts->points(n);
    DirectLight point = light;
    point.parts = nullptr;
    float seen[trace::kPacket] = {}, all[trace::kPacket] = {};
    unsigned left = active;
    for (unsigned k = 0; k < to.size() && left != 0; ++k) {
        point.position = light.position + to[to.size() == kFewPoints ? kOrder[k] : k];
        alignas(64) float arrives[trace::kPacket];
        direct_points(point, points, trace::kPacket, arrives);
        unsigned lit = 0;
        for (int i = 0; i < trace::kPacket; ++i) lit |= ((left >> i & 1u) != 0 && arrives[i] > 0.0f ? 1u : 0u) << i;
        ask(point, lit);
        for (int i = 0; i < trace::kPacket; ++i) {
            if ((lit >> i & 1u) == 0) continue;
            seen[i] += arrives[i] * passed[i];
            all[i] += arrives[i];
        }
        if (to.size() != kFewPoints || k + 1 != kFirst) continue;
        for (int i = 0; i < trace::kPacket; ++i)
            if (all[i] > 0.0f && (seen[i] <= 0.0f || seen[i] >= all[i])) left &= ~(1u << i);
    }
    for (int i = 0; i < trace::kPacket; ++i)
        if ((active >> i & 1u) != 0) share[i] = all[i] > 0.0f ? seen[i] / all[i] : 0.0f;
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

void soften_grid(const GBuffer& gbuffer, const Grid& grid, const trace::Geometry& geometry, const DirectLight& light,
                 std::vector<float>& ratio, std::vector<float>& through, Pool& pool) {
    const std::vector<float> first = through;
    const auto mixed = [&](int x, int y) {
        float least = 1.0f, greatest = 0.0f;
        for (int row = std::max(y - 2, 0); row < std::min(y + 3, grid.height); ++row)
            for (int column = std::max(x - 2, 0); column < std::min(x + 3, grid.width); ++column) {
                const float value = first[static_cast<std::size_t>(grid.at(column, row))];
                if (value < 0.0f) continue;
                least = std::min(least, value), greatest = std::max(greatest, value);
            }
        return greatest - least > 0.05f;
    };
    pool.run(grid.height, [&](int y) {
        std::size_t at[trace::kPacket];
        alignas(64) float values[7][trace::kPacket] = {};
        int waiting = 0;
        const auto send = [&] {
            float share[trace::kPacket];
            visible_share(geometry, light, gbuffer, points_at(values, 0), values[6], (1u << waiting) - 1u, kFewPoints,
                          share);
            for (int i = 0; i < waiting; ++i) through[at[i]] = share[i];
            waiting = 0;
        };
        for (int x = 0; x < grid.width; ++x) {
            const auto own = static_cast<std::size_t>(grid.at(x, y));
            if (first[own] < 0.0f || !mixed(x, y)) continue;
            at[waiting] = own;
            for (std::size_t v = 0; v < 7; ++v) values[v][waiting] = grid.values[v][own];
            if (++waiting == trace::kPacket) send();
        }
        if (waiting > 0) send();
        for (int x = 0; x < grid.width; ++x) {
            const auto own = static_cast<std::size_t>(grid.at(x, y));
            if (first[own] < 0.0f)
                through[own] = 1.0f;  // it does not tell
            else
                ratio[own] = through[own] > 0.0f ? std::abs(ratio[own]) : -std::abs(ratio[own]);
        }
    });
}

}  // namespace gonio::lighting
