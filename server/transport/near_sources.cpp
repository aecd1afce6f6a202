#include "server/transport/near_sources.h"

#include <algorithm>
#include <limits>
#include <numbers>

#include "server/trace/sampler.h"
#include "server/transport/space_hash.h"

namespace gonio::transport {
namespace {

constexpr std::size_t kMostRays = 1u << 17;  // of all sources together

}  // namespace

trace::RayPacket rays_around(const glm::vec3& place, float off_m, std::uint32_t stream, unsigned first, float far_m) {
    trace::RayPacket rays;
    const std::uint32_t u = trace::mix_bits(stream, 0x7f4a7c15u), v = trace::mix_bits(stream, 0x1b873593u);
    for (unsigned i = 0; i < trace::kPacket; ++i) {
        const glm::vec3 along = trace::any_direction(trace::scrambled_pair(first + i, u, v));
        rays.set(static_cast<int>(i), place + along * off_m, along, far_m);
    }
    return rays;
}

NearSources::NearSources(const trace::Geometry& geometry, std::vector<Source> sources, const Bounds& bounds)
    : geometry_(geometry), sources_(std::move(sources)), at_once_(bounds.at_once) {
    const std::size_t each = std::min<std::size_t>(bounds.rays, kMostRays / std::max<std::size_t>(sources_.size(), 1));
    rays_ = std::max(1u, static_cast<unsigned>(each) / trace::kPacket) * trace::kPacket;
    for (const Source& source : sources_) side_m_ = std::max(side_m_, 2.0f * source.reach_m);
    for (std::uint32_t i = 0; i < sources_.size(); ++i) {
        const auto& [position, reach_m] = sources_[i];
        const glm::ivec3 low = cell_at(position - reach_m, side_m_), high = cell_at(position + reach_m, side_m_);
        glm::ivec3 cell;
        for (cell.z = low.z; cell.z <= high.z; ++cell.z)
            for (cell.y = low.y; cell.y <= high.y; ++cell.y)
                for (cell.x = low.x; cell.x <= high.x; ++cell.x) by_cell_.emplace_back(hash_of(cell), i);
    }
    std::sort(by_cell_.begin(), by_cell_.end());
}

NearSources::Near NearSources::at(const trace::SurfacePoint& point) const {
    constexpr float kNone = std::numeric_limits<float>::infinity();
    Near near{kNone, kNone};
    if (sources_.empty()) return near;
    const std::uint32_t cell = hash_of(cell_at(point.position, side_m_));
    auto one = std::lower_bound(by_cell_.begin(), by_cell_.end(), std::pair(cell, 0u));
    if (by_cell_.end() - one > at_once_ && one[at_once_].first == cell) return near;
    for (std::uint32_t last = ~0u; one != by_cell_.end() && one->first == cell; ++one) {
        if (std::exchange(last, one->second) == one->second) continue;  // two of its cells have one hash
        const auto& [source, reach_m] = sources_[one->second];
        const glm::vec3 along = source - point.position;
        const float distance_m = glm::length(along), facing = glm::dot(along, point.geometric);
        if (!(distance_m < reach_m) || facing <= 0.0f) continue;
        const glm::vec3 from = point.position + point.geometric * (4.0f * geometry_.step_off(point.position));
        if (geometry_.occluded(from, source)) continue;
        const float passed = geometry_.transmissive() ? trace::luminous(geometry_.transmittance(from, source)) : 1.0f;
        near.distance_m = std::min(near.distance_m, distance_m);
        near.reach_m = std::min(near.reach_m, reach_m);
        const double d = static_cast<double>(distance_m);
        near.rays_per_m2 += rays_ * static_cast<double>(passed * facing) / (4.0 * std::numbers::pi * d * d * d);
    }
    return near;
}

std::vector<NearSources::End> NearSources::rays(Pool& pool, const std::function<bool()>& stopped) const {
    std::vector<std::vector<End>> found(sources_.size());
    pool.run(static_cast<int>(sources_.size()), [&](int source) {
        const auto stream = static_cast<std::uint32_t>(source);
        const auto& [from, reach_m] = sources_[stream];
        for (unsigned first = 0; first < rays_ && !stopped(); first += trace::kPacket) {
            // A luminaire may be mounted on a surface: its rays must not end there.
            const trace::RayPacket rays = rays_around(from, geometry_.step_off(from), stream, first, reach_m);
            trace::HitPacket hits;
            const unsigned met = geometry_.closest(rays, ~0u >> (32 - trace::kPacket), hits);
            for (int i = 0; i < trace::kPacket; ++i) {
                if ((met >> i & 1u) == 0) continue;
                found[stream].push_back({static_cast<int>(hits.instance[i]), static_cast<int>(hits.triangle[i]),
                                         hits.u[i], hits.v[i], glm::dot(rays.along(i), hits.normal(i)) < 0.0f});
            }
        }
    });
    std::vector<End> ends;
    for (const auto& some : found) ends.insert(ends.end(), some.begin(), some.end());
    return ends;
}

}  // namespace gonio::transport
