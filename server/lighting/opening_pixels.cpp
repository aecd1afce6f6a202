#include "server/lighting/opening_pixels.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "server/scene/opening_points.h"
#include "server/trace/luminous.h"

namespace gonio::lighting {
namespace {

constexpr int kSide = 4;  // samples of a pixel along each side

glm::dvec3 ray_at(const Rays& rays, double x, double y) {
    return glm::dvec3(rays.corner) + x * glm::dvec3(rays.right) + y * glm::dvec3(rays.up);
}

struct Rectangle {
    int left, right, low, high;  // pixels, the last included
};
// Result: the pixels that may show a luminaire.
Rectangle around(const trace::Luminaire& luminaire, const GBuffer& s) {
    const glm::dmat3 pixels = glm::inverse(glm::dmat3(s.rays.right, s.rays.up, s.rays.corner));
    const glm::dvec3 half = half_sides(luminaire.opening);
    glm::dvec2 least(1e9), greatest(-1e9);
    for (int i = 0; i < 8; ++i) {
        const glm::dvec3 corner =
            half * glm::dvec3((i & 1) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1, (i & 4) != 0 ? 1 : -1);
        const glm::dvec3 at =
            pixels * (luminaire.position + luminaire.world_from_light * corner - glm::dvec3(s.rays.eye));
        if (!(at.z > 1e-3)) {  // it reaches behind the eye
            least = glm::dvec2(-1.0), greatest = glm::dvec2(s.width, s.height);
            break;
        }
        least = glm::min(least, glm::dvec2(at) / at.z), greatest = glm::max(greatest, glm::dvec2(at) / at.z);
    }
    const auto bound = [](double x, int size) { return static_cast<int>(std::clamp(x, -1.0, size + 1.0)); };
    return {std::max(0, bound(std::floor(least.x), s.width)),
            std::min(s.width - 1, bound(std::ceil(greatest.x), s.width)),
            std::max(0, bound(std::floor(least.y), s.height)),
            std::min(s.height - 1, bound(std::ceil(greatest.y), s.height))};
}

struct Met {
    glm::dvec3 along;  // unit
    trace::Shining shining;
};
// The samples of a pixel that meet the opening. An outline has no dents: where the outermost samples are within it, all
// are, and stand for all.
struct Samples {
    std::array<Met, kSide * kSide> met;
    std::size_t count = 0;
    float covered = 0.0f;
};
Samples samples_of(const trace::Luminaire& luminaire, const Rays& rays, int x, int y) {
    Samples samples;
    const auto take = [&](int i, int j) {
        const glm::dvec3 along = glm::normalize(ray_at(rays, x + (i + 0.5) / kSide - 0.5, y + (j + 0.5) / kSide - 0.5));
        if (const auto shining = trace::shining_at(luminaire, glm::dvec3(rays.eye), along))
            samples.met[samples.count++] = {along, *shining};
    };
    for (const int i : {0, kSide - 1})
        for (const int j : {0, kSide - 1}) take(i, j);
    samples.covered = 1.0f;
    if (samples.count == 4) return samples;
    samples.count = 0;
    for (int i = 0; i < kSide; ++i)
        for (int j = 0; j < kSide; ++j) take(i, j);
    samples.covered = static_cast<float>(samples.count) / (kSide * kSide);
    return samples;
}

// Result: 1 where all surfaces around a pixel are behind that depth, 0 where all are before it; else negative.
float seen_by_depth(const GBuffer& s, int x, int y, double depth_m) {
    int before = 0, all = 0;
    for (int row = std::max(y - 1, 0); row <= std::min(y + 1, s.height - 1); ++row) {
        for (int column = std::max(x - 1, 0); column <= std::min(x + 1, s.width - 1); ++column, ++all) {
            const float depth =
                s.depth[static_cast<std::size_t>(row) * s.row_length + static_cast<std::size_t>(column)];
            const double surface_m = depth > 0.0f ? static_cast<double>(s.rays.near_m / depth) : 1e30;
            before += surface_m < depth_m * (1.0 - trace::kShiningSlack) - trace::kShiningSlack_m ? 1 : 0;
        }
    }
    return before == 0 ? 1.0f : before == all ? 0.0f : -1.0f;
}

// Result: what an eye sees of a sample by a ray, 0 … 1. dice: of transmissive surfaces.
float seen_by_ray(const trace::Geometry& geometry, const glm::vec3& eye, const Met& met, std::uint32_t dice) {
    trace::SurfaceHit hit;
    if (!geometry.closest(eye, glm::vec3(met.along), 0.0f, true, hit, dice)) return 1.0f;
    const double end = met.shining.distance_m * (1.0 - trace::kShiningSlack) - trace::kShiningSlack_m;
    return static_cast<double>(hit.distance) < end ? 0.0f : trace::luminance(hit.tint);
}

void see(const trace::Luminaire& luminaire, const GBuffer& s, const trace::Geometry& geometry, bool bodies, int y,
         const Rectangle& bounds, std::vector<OpeningPixel>& found) {
    for (int x = bounds.left; x <= bounds.right; ++x) {
        const Samples samples = samples_of(luminaire, s.rays, x, y);
        double sum = 0.0;
        for (std::size_t i = 0; i < samples.count; ++i) sum += samples.met[i].shining.nit;
        if (!(sum > 0.0)) continue;
        const Met& middle = samples.met[samples.count / 2];
        const double per_depth = glm::length(ray_at(s.rays, x, y));
        float seen =
            geometry.transmissive() || bodies ? -1.0f : seen_by_depth(s, x, y, middle.shining.distance_m / per_depth);
        double nit = sum / static_cast<double>(samples.count);
        if (seen < 0.0f) {
            constexpr std::size_t kRays = 4;
            seen = 0.0f;
            const std::size_t rays = std::min(kRays, samples.count);
            for (std::size_t i = 0; i < rays; ++i) {
                const std::size_t which = i * samples.count / rays;
                const auto dice = static_cast<std::uint32_t>((static_cast<float>(i) + 0.5f) / kRays *
                                                             static_cast<float>(trace::Geometry::kDice));
                seen += seen_by_ray(geometry, s.rays.eye, samples.met[which], dice) / static_cast<float>(rays);
            }
        }
        const float covered = samples.covered * seen;
        if (covered > 0.0f)
            found.push_back({static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), luminaire.light, covered,
                             covered * static_cast<float>(nit)});
    }
}

}  // namespace

std::vector<OpeningPixel> see_openings(std::span<const trace::Luminaire> luminaires, const GBuffer& gbuffer,
                                       const trace::Geometry& geometry, bool bodies, Pool& pool) {
    std::vector<std::vector<OpeningPixel>> rows(static_cast<std::size_t>(gbuffer.height));
    for (const trace::Luminaire& luminaire : luminaires) {
        const Rectangle bounds = around(luminaire, gbuffer);
        if (bounds.left > bounds.right || bounds.low > bounds.high) continue;
        pool.run(bounds.high - bounds.low + 1, [&](int job) {
            const int y = bounds.low + job;
            see(luminaire, gbuffer, geometry, bodies, y, bounds, rows[static_cast<std::size_t>(y)]);
        });
    }
    std::vector<OpeningPixel> all;
    for (std::vector<OpeningPixel>& row : rows) {
        std::stable_sort(row.begin(), row.end(),
                         [](const OpeningPixel& a, const OpeningPixel& b) { return a.x < b.x; });
        all.insert(all.end(), row.begin(), row.end());
    }
    return all;
}

std::vector<ShiningPixel> weigh_openings(std::span<const OpeningPixel> pixels,
                                         const std::function<glm::vec3(std::uint32_t)>& weight_of) {
    std::vector<ShiningPixel> shown;
    std::uint32_t light = 0;
    glm::vec3 weight(0.0f);
    for (const OpeningPixel& pixel : pixels) {
        if (pixel.light != light) weight = weight_of(light = pixel.light);
        if (weight == glm::vec3(0.0f)) continue;
        if (shown.empty() || shown.back().x != pixel.x || shown.back().y != pixel.y)
            shown.push_back({pixel.x, pixel.y, 0.0f, glm::vec3(0.0f)});
        shown.back().covered = std::min(1.0f, shown.back().covered + pixel.covered);
        shown.back().nit += weight * pixel.nit;
    }
    return shown;
}

}  // namespace gonio::lighting
