#include "server/lighting/shadow_edges.h"

#include <algorithm>
#include <cmath>

#include "server/lighting/antialias.h"

namespace gonio::lighting {
namespace {

struct Side {
    int dx, dy;
};
constexpr Side kSides[] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};
// A pixel that a shadow's edge may cross.
struct Candidate {
    int x, y;
    Spot spot;
    std::uint64_t others = 0;  // as of Edges
    float brightest = 0.0f;    // of its light and that of those beside it
};

bool inside(const GBuffer& gbuffer, int x, int y) {
    return x >= 0 && y >= 0 && x < gbuffer.width && y < gbuffer.height;
}

bool on_plane(const GBuffer& gbuffer, const Spot& spot, const Spot& other) {
    return other.depth > 0.0f && glm::dot(spot.normal, other.normal) > 0.8f &&
           std::abs(glm::dot(spot.normal, other.position - spot.position)) < gbuffer.depth_per_pixel * spot.depth;
}

std::uint64_t others_of(const Edges& edges, int x, int y) {
    const auto row = static_cast<std::size_t>(y);
    const auto first = edges.pixels.begin() + edges.rows[row], last = edges.pixels.begin() + edges.rows[row + 1];
    const auto found = std::lower_bound(first, last, static_cast<std::uint32_t>(x),
                                        [](const layouts::EdgePixel& pixel, std::uint32_t at) { return pixel.x < at; });
    if (found == last || found->x != static_cast<std::uint32_t>(x)) return 0;
    return edges.others[static_cast<std::size_t>(found - edges.pixels.begin())];
}

// Result: of a row.
std::vector<Candidate> candidates_of(const GBuffer& gbuffer, const Edges& edges, const std::vector<float>& light,
                                     int y) {
    std::vector<Candidate> found;
    const auto at = [&](int x, int row) {
        return static_cast<std::size_t>(row) * gbuffer.row_length + static_cast<std::size_t>(x);
    };
    for (int x = 0; x < gbuffer.width; ++x) {
        if (!(gbuffer.depth[at(x, y)] > 0.0f)) continue;
        const bool lit = light[at(x, y)] > 0.0f;
        const bool differs = std::any_of(std::begin(kSides), std::end(kSides), [&](const Side& side) {
            const int px = x + side.dx, py = y + side.dy;
            return inside(gbuffer, px, py) && gbuffer.depth[at(px, py)] > 0.0f && (light[at(px, py)] > 0.0f) != lit;
        });
        if (!differs) continue;
        const Spot spot = spot_at(gbuffer, x, y);
        const bool edge = std::any_of(std::begin(kSides), std::end(kSides), [&](const Side& side) {
            const int px = x + side.dx, py = y + side.dy;
            return inside(gbuffer, px, py) && (light[at(px, py)] > 0.0f) != lit &&
                   on_plane(gbuffer, spot, spot_at(gbuffer, px, py));
        });
        if (!edge) continue;
        float brightest = light[at(x, y)];
        for (const Side& side : kSides)
            if (inside(gbuffer, x + side.dx, y + side.dy))
                brightest = std::max(brightest, light[at(x + side.dx, y + side.dy)]);
        found.push_back({x, y, spot, others_of(edges, x, y), brightest});
    }
    return found;
}

// Result: the share of a pixel's samples that see the luminaire, less what transmissive surfaces keep; negative: none
// of them shows what the centre does.
float seen_share(const GBuffer& gbuffer, const trace::Geometry& geometry, const DirectLight& luminaire, unsigned n,
                 const Candidate& pixel) {
    const Rays& rays = gbuffer.rays;
    const Spot& spot = pixel.spot;
    const glm::vec3 ray =
        rays.corner + static_cast<float>(pixel.x) * rays.right + static_cast<float>(pixel.y) * rays.up;
    const float facing = glm::dot(spot.normal, ray);
    float seen = 0.0f;
    int all = 0;
    alignas(64) float values[6][trace::kPacket] = {}, depth[trace::kPacket] = {};
    glm::vec3 targets[trace::kPacket];
    std::fill_n(targets, trace::kPacket, luminaire.position);
    int waiting = 0;
    const auto send = [&] {
        float passed[trace::kPacket];
        std::fill_n(passed, trace::kPacket, 1.0f);
        const unsigned open =
            unhidden(geometry, luminaire, gbuffer, points_at(values, 0), depth, (1u << waiting) - 1u, passed, targets);
        for (int i = 0; i < waiting; ++i) seen += (open >> i & 1u) != 0 ? passed[i] : 0.0f;
        all += waiting;
        waiting = 0;
    };
    for (unsigned i = 0; i < n; ++i) {
        if ((pixel.others >> i & 1u) != 0) continue;
        const glm::vec2 offset = sample_offset(i, n);
        const glm::vec3 to = ray + offset.x * rays.right + offset.y * rays.up;
        const float z = spot.depth * facing / glm::dot(spot.normal, to);
        if (!(z > 0.5f * spot.depth && z < 2.0f * spot.depth)) continue;
        const glm::vec3 position = rays.eye + to * z;
        for (int k = 0; k < 3; ++k) {
            values[k][waiting] = position[k];
            values[k + 3][waiting] = spot.normal[k];
        }
        depth[waiting] = z;
        if (luminaire.parts)  // each sample to a point of its own
            targets[waiting] = luminaire.position + luminaire.parts->many[(i * 37u) % kManyPoints];
        if (++waiting == trace::kPacket) send();
    }
    if (waiting > 0) send();
    return all > 0 ? seen / static_cast<float>(all) : -1.0f;
}

// Adds the direct light of points, in luminaire.unit_m2, × its weights.
void add_lit(const GBuffer& gbuffer, const trace::Geometry& geometry, const DirectLight& luminaire,
             const std::vector<Edges::Point>& points, std::vector<glm::vec3>& light) {
    static_assert(trace::kPacket == static_cast<int>(kSimdWidth));
    for (std::size_t first = 0; first < points.size(); first += kSimdWidth) {
        const std::size_t count = std::min(kSimdWidth, points.size() - first);
        alignas(64) float values[6][kSimdWidth] = {}, depth[kSimdWidth] = {}, arrives[kSimdWidth], passed[kSimdWidth];
        for (std::size_t i = 0; i < count; ++i) {
            const Edges::Point& point = points[first + i];
            for (int k = 0; k < 3; ++k) {
                values[k][i] = point.position[k];
                values[k + 3][i] = point.normal[k];
            }
            depth[i] = point.depth;
        }
        direct_points(luminaire, points_at(values, 0), kSimdWidth, arrives);
        unsigned active = 0;
        for (std::size_t i = 0; i < count; ++i) active |= arrives[i] > 0.0f ? 1u << i : 0u;
        if (active == 0) continue;
        visible_share(geometry, luminaire, gbuffer, points_at(values, 0), depth, active, kFewPoints, passed);
        for (std::size_t i = 0; i < count; ++i) {
            if ((active >> i & 1u) != 0) light[first + i] += arrives[i] * passed[i] * luminaire.weight;
        }
    }
}

}  // namespace

void light_mixed_pixels(const GBuffer& gbuffer, const trace::Geometry& geometry,
                        std::span<const DirectLight> luminaires, const Edges& edges, Planes& light, Pool& pool) {
    pool.run(gbuffer.height, [&](int y) {
        const auto row = static_cast<std::size_t>(y);
        const std::vector<Edges::Point>& points = edges.points[row];
        std::vector<glm::vec3> own(points.size(), glm::vec3(0.0f));
        for (const DirectLight& luminaire : luminaires) add_lit(gbuffer, geometry, luminaire, points, own);
        for (const Edges::Mixed& pixel : edges.mixed[row]) {
            glm::vec3 sum(0.0f);
            float all = pixel.albedo;
            for (std::size_t i = pixel.first; i < pixel.first + pixel.count; ++i) {
                sum += points[i].albedo * own[i];
                all += points[i].albedo;
            }
            for (std::size_t k = 0; k < light.size(); ++k) {
                float& here = light[k][row * gbuffer.row_length + pixel.x];
                here = (pixel.albedo * here + sum[static_cast<int>(k)]) / all;
            }
        }
    });
}

void sample_shadow_edges(const GBuffer& gbuffer, const trace::Geometry& geometry, const DirectLight& luminaire,
                         const Edges& edges, unsigned n, std::vector<float>& light, Pool& pool) {
    std::vector<std::vector<Candidate>> rows(static_cast<std::size_t>(gbuffer.height));
    pool.run(gbuffer.height,
             [&](int y) { rows[static_cast<std::size_t>(y)] = candidates_of(gbuffer, edges, light, y); });
    pool.run(gbuffer.height, [&](int y) {
        const std::vector<Candidate>& row = rows[static_cast<std::size_t>(y)];
        for (std::size_t first = 0; first < row.size(); first += kSimdWidth) {
            const std::size_t count = std::min(kSimdWidth, row.size() - first);
            alignas(64) float values[6][kSimdWidth] = {}, arrives[kSimdWidth];
            for (std::size_t i = 0; i < count; ++i) {
                const Candidate& pixel = row[first + i];
                const glm::vec3 normal = lit_normal_at(gbuffer, pixel.x, pixel.y);
                for (int k = 0; k < 3; ++k) {
                    values[k][i] = pixel.spot.position[k];
                    values[k + 3][i] = normal[k];
                }
            }
            direct_points(luminaire, points_at(values, 0), kSimdWidth, arrives);
            for (std::size_t i = 0; i < count; ++i) {
                const Candidate& pixel = row[first + i];
                // The edge of a penumbra is faint, and has more rays than samples.
                const float least = luminaire.parts ? 0.5f * arrives[i] * luminaire.weight.x : 0.0f;
                if (!(arrives[i] > 0.0f) || pixel.brightest < least) continue;
                const float share = seen_share(gbuffer, geometry, luminaire, n, pixel);
                if (share >= 0.0f)
                    light[static_cast<std::size_t>(y) * gbuffer.row_length + static_cast<std::size_t>(pixel.x)] =
                        share * arrives[i] * luminaire.weight.x;
            }
        }
    });
}

void direct_light_with_edges(const GBuffer& gbuffer, const ScreenGrid& screen, const trace::Geometry& geometry,
                             std::span<const DirectLight> luminaires, const Edges& edges, unsigned n, Planes& out,
                             Pool& pool) {
    for (std::vector<float>& plane : out)
        plane.assign(gbuffer.row_length * static_cast<std::size_t>(gbuffer.height), 0.0f);
    Planes own(1);
    Lattice unused;  // each pixel has a ray of its own
    for (const DirectLight& luminaire : luminaires) {
        DirectLight at_one = luminaire;
        at_one.weight = glm::vec3(1.0f);
        direct_light(gbuffer, screen, geometry, std::span(&at_one, 1), true, own, unused, pool);
        sample_shadow_edges(gbuffer, geometry, at_one, edges, n, own[0], pool);
        pool.run(gbuffer.height, [&](int y) {
            const std::size_t first = static_cast<std::size_t>(y) * gbuffer.row_length;
            for (std::size_t k = 0; k < out.size(); ++k) {
                const float weight = luminaire.weight[static_cast<int>(k)];
                for (std::size_t i = first; i < first + gbuffer.row_length; ++i) out[k][i] += weight * own[0][i];
            }
        });
    }
}

}  // namespace gonio::lighting
