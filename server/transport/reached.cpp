#include "server/transport/reached.h"

#include <algorithm>
#include <cmath>

#include "server/trace/sampler.h"

namespace gonio::transport {

bool in_sight(const trace::Geometry& geometry, const glm::vec3& p, const glm::vec3& n, const glm::vec3& q,
              const glm::vec3& m, float above_m) {
    const glm::vec3 from = p + n * (4.0f * geometry.step_off(p)), to = q + m * (4.0f * geometry.step_off(q));
    if (!geometry.occluded(from, to)) return true;
    const glm::vec3 high = p + n * above_m, high_other = q + m * above_m;
    return !geometry.occluded(from, high) && !geometry.occluded(high, high_other) && !geometry.occluded(high_other, to);
}

void set_diffuse_step(trace::RayPacket& rays, int i, const trace::Geometry& geometry, const trace::SurfacePoint& from,
                      const glm::vec2& random, float far_m) {
    rays.set(i, from.position + from.geometric * geometry.step_off(from.position),
             trace::around(from.geometric, trace::cosine_hemisphere(random)), far_m);
}

bool Reached::add(const trace::Geometry& geometry, const glm::vec3& p, const glm::vec3& normal) {
    std::uint32_t& bucket = buckets_[bucket_of(p, normal)];
    if (bucket == 0) {
        some_.emplace_back();
        bucket = static_cast<std::uint32_t>(some_.size());
    }
    Some& some = some_[bucket - 1];
    if (some.count == kMost) return false;
    if (some.count >= kFew) {
        // Few points in the plane of another one are hidden from it; asking takes rays.
        const auto level = [&](const auto& other) {
            return std::abs(glm::dot(p - other.first, other.second)) < 0.02f * side_m_;
        };
        if (std::any_of(some.points, some.points + some.count, level) && ++some.met % 8 != 0) return false;
        if (sees(geometry, p, normal)) return false;
    }
    some.points[some.count++] = {p, normal};
    return true;
}

bool Reached::sees(const trace::Geometry& geometry, const glm::vec3& p, const glm::vec3& normal) const {
    const std::uint32_t bucket = buckets_[bucket_of(p, normal)];
    if (bucket == 0) return false;
    const Some& some = some_[bucket - 1];
    for (int i = 0; i < some.count; ++i) {
        if (in_sight(geometry, p, normal, some.points[i].first, some.points[i].second, 0.1f * side_m_)) return true;
    }
    return false;
}

std::size_t Reached::bucket_of(const glm::vec3& p, const glm::vec3& n) const {
    const glm::vec3 a = glm::abs(n);
    const int axis = a.x > a.y && a.x > a.z ? 0 : a.y > a.z ? 1 : 2;
    const auto bin = static_cast<std::uint32_t>(2 * axis + (n[axis] < 0.0f ? 1 : 0));
    return trace::mix_bits(hash_of(cell_at(p, side_m_)), bin) & (buckets_.size() - 1);
}

}  // namespace gonio::transport
