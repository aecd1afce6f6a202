#include "server/transport/candidates.h"

#include <algorithm>
#include <cmath>

#include "server/trace/sampler.h"

namespace gonio::transport {
namespace {

// Result: bits of the points at which a ray meets no other opaque triangle. Where faces of two things coincide, as
// under a wall that stands on a floor, it meets one of them, and their area must not count twice.
unsigned meets(const trace::Geometry& geometry, std::span<const Drawn> drawn) {
    trace::RayPacket rays;
    for (std::size_t k = 0; k < drawn.size(); ++k) {
        const trace::SurfaceHit& hit = drawn[k].hit;
        const float above_m = geometry.step_off(hit.position);
        rays.set(static_cast<int>(k), hit.position + hit.geometric * above_m, -hit.geometric, 2.0f * above_m);
    }
    trace::HitPacket hits;
    const unsigned all = ~0u >> (32 - drawn.size()), any = geometry.closest(rays, all, hits);
    unsigned own = all;
    for (std::size_t k = 0; k < drawn.size(); ++k) {
        if ((any >> k & 1u) == 0) continue;
        const auto instance = static_cast<int>(hits.instance[k]), triangle = static_cast<int>(hits.triangle[k]);
        const bool other = instance != drawn[k].hit.instance || triangle != drawn[k].hit.triangle;
        // Light passes through a pane, so the surface under it counts as well.
        if (other && !(geometry.transparency_at(instance, triangle, hits.u[k], hits.v[k]).share > 0.0f))
            own &= ~(1u << k);
    }
    return own;
}

constexpr unsigned kRays = 4, kFacing = trace::kPacket / kRays;  // of each point; points of a packet
// Result: bits of the first kFacing points from which some rays meet surfaces, and half of those that do meet one that
// was reached. Walks miss small faces, such as the edges of a table top; these face what the walks have met.
unsigned facing_reached(const trace::Geometry& geometry, std::span<const Drawn> drawn, const Reached& reached) {
    trace::RayPacket rays;
    for (unsigned k = 0; k < drawn.size() * kRays; ++k) {
        const Drawn& from = drawn[k / kRays];
        trace::Sample sample(0x1b873593u, from.index * kRays + k % kRays);
        set_diffuse_step(rays, static_cast<int>(k), geometry, from.hit, sample.next());
    }
    trace::SurfaceHit hits[trace::kPacket];
    const unsigned met = geometry.closest(rays, ~0u >> (32 - drawn.size() * kRays), hits, false);
    unsigned facing = 0;
    for (unsigned i = 0; i < drawn.size(); ++i) {
        unsigned any = 0, seen = 0;
        for (unsigned k = i * kRays; k < (i + 1) * kRays; ++k) {
            if ((met >> k & 1u) == 0) continue;  // into the open
            ++any;
            if (reached.sees(geometry, hits[k].position, hits[k].geometric)) ++seen;
        }
        if (any > 0 && 2 * seen >= any) facing |= 1u << i;
    }
    return facing;
}

// Calls job(point) for those whose bits are in chosen(points), which is asked for so many points at a time.
template <typename Chosen, typename Job>
void for_chosen(std::span<const Drawn> drawn, std::size_t most, const Chosen& chosen, const Job& job) {
    while (!drawn.empty()) {
        const std::span<const Drawn> some = drawn.first(std::min(most, drawn.size()));
        drawn = drawn.subspan(some.size());
        const unsigned bits = chosen(some);
        for (std::size_t k = 0; k < some.size(); ++k)
            if ((bits >> k & 1u) != 0) job(some[k]);
    }
}

}  // namespace

Candidate candidate_at(const trace::Geometry& geometry, const trace::SurfaceHit& hit, float u, float v,
                       double area_m2) {
    const float passed =
        geometry.transmissive() ? geometry.transparency_at(hit.instance, hit.triangle, u, v).share : 0.0f;
    return {hit, hit.albedo, geometry.detailed_normal(hit, u, v), 1.0f - passed, area_m2};
}

Areas::Areas(const trace::Geometry& geometry, std::span<const std::pair<int, int>> only) {
    const SceneAsset& asset = geometry.asset();
    for (std::size_t i = 0; i < asset.instances.size(); ++i) {
        const Mesh& mesh = asset.meshes[static_cast<std::size_t>(asset.instances[i].mesh)];
        for (std::size_t t = 0; t < mesh.indices.size() / 3; ++t) {
            const auto c = geometry.corners(static_cast<int>(i), static_cast<int>(t));
            const glm::dvec3 a(c[0]), b(c[1]), d(c[2]);
            const double area_m2 = 0.5 * glm::length(glm::cross(b - a, d - a));
            if (!(area_m2 > 0.0) || !std::isfinite(area_m2)) continue;
            const std::pair<int, int> own(static_cast<int>(i), static_cast<int>(t));
            if (!only.empty() && !std::binary_search(only.begin(), only.end(), own)) continue;
            const double longest_m = std::max({glm::distance(a, b), glm::distance(b, d), glm::distance(d, a)});
            running.push_back(running.back() + area_m2);
            triangles.push_back({own.first, own.second, static_cast<float>(longest_m), area_m2});
        }
    }
}

void Areas::widen(float width_m) {
    constexpr double kMost = 1.0 / 30.0;
    const double all_m2 = running.back();
    // A long face is two triangles, of half its area each.
    const auto drawn_m2 = [](const Triangle& one, double wide_m) {
        const double longest_m = static_cast<double>(one.longest_m);
        return longest_m > 2.0 * wide_m ? std::max(one.area_m2, 0.5 * longest_m * wide_m) : one.area_m2;
    };
    for (double wide_m = static_cast<double>(width_m);; wide_m *= 0.7) {
        for (std::size_t i = 0; i < triangles.size(); ++i) running[i + 1] = running[i] + drawn_m2(triangles[i], wide_m);
        if (running.back() <= (1.0 + kMost) * all_m2) return;
    }
}

std::size_t Areas::find(int instance, int triangle) const {
    const auto found = std::lower_bound(
        triangles.begin(), triangles.end(), std::pair(instance, triangle),
        [](const Triangle& one, const auto& own) { return std::pair(one.instance, one.triangle) < own; });
    const bool is_it =
        found != triangles.end() && std::pair(found->instance, found->triangle) == std::pair(instance, triangle);
    return is_it ? static_cast<std::size_t>(found - triangles.begin()) : triangles.size();
}

void each_drawn(const trace::Geometry& geometry, const Areas& areas, std::size_t count, std::uint32_t seed,
                std::size_t first, std::size_t size, const std::function<void(const Drawn&)>& job) {
    const double share_m2 = areas.running.back() / static_cast<double>(count);
    auto above =
        std::upper_bound(areas.running.begin() + 1, areas.running.end() - 1, share_m2 * static_cast<double>(first));
    for (std::size_t i = first; i < first + size; ++i) {
        const auto index = static_cast<std::uint32_t>(i);
        trace::Sample sample(seed, index);
        const glm::vec2 which = sample.next(), where = sample.next();  // independent of each other
        const double at = share_m2 * (static_cast<double>(i) + static_cast<double>(which.x));
        while (*above <= at && above + 1 < areas.running.end()) ++above;
        const auto own = static_cast<std::size_t>(above - areas.running.begin()) - 1;
        const Areas::Triangle& of = areas.triangles[own];
        const float root = std::sqrt(where.x), u = root * (1.0f - where.y), v = root * where.y;
        Drawn drawn{{}, u, v, index, own};
        if (geometry.surface_at(of.instance, of.triangle, u, v, which.y < 0.5f, drawn.hit)) job(drawn);
    }
}

std::vector<Candidate> candidates(const trace::Geometry& geometry, const Areas& areas, std::size_t count,
                                  std::uint32_t seed, const Reached& reached, Pool& pool,
                                  const std::function<bool()>& stopped) {
    constexpr std::size_t kChunk = 1024;
    std::vector<std::vector<Candidate>> found((count + kChunk - 1) / kChunk);
    pool.run_chunks(count, kChunk, [&](std::size_t first, std::size_t size) {
        if (stopped()) return;
        std::vector<Drawn> drawn, doubtful;
        each_drawn(geometry, areas, count, seed, first, size, [&](const Drawn& one) {
            (reached.sees(geometry, one.hit.position, one.hit.geometric) ? drawn : doubtful).push_back(one);
        });
        for_chosen(
            doubtful, kFacing, [&](std::span<const Drawn> some) { return facing_reached(geometry, some, reached); },
            [&](const Drawn& one) { drawn.push_back(one); });
        for_chosen(
            drawn, trace::kPacket, [&](std::span<const Drawn> some) { return meets(geometry, some); },
            [&](const Drawn& one) {
                found[first / kChunk].push_back(
                    candidate_at(geometry, one.hit, one.u, one.v, areas.each_m2(one.of, count)));
            });
    });
    std::vector<Candidate> all;
    for (const auto& some : found) all.insert(all.end(), some.begin(), some.end());
    return all;
}

}  // namespace gonio::transport
