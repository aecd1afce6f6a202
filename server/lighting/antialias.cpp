#include "server/lighting/antialias.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/packing.hpp>

namespace gonio::lighting {
namespace {

// Two points are on one surface where one is no further off the other's plane than this share of a pixel's width, and
// the cosine between their normals is no less.
constexpr float kOffPlane = 0.5f, kCosine = 0.8f;
// Reflectance that differs by less, and emission by a smaller share, are of one material.
constexpr float kAlbedoStep = 0.02f, kEmissionStep = 0.02f;
constexpr std::size_t kMostPerPixel = 4;

// What a G-buffer shows at a pixel.
struct Shown {
    Spot spot;
    glm::vec3 albedo{0.0f}, emission_nit{0.0f};
};
Shown shown_at(const GBuffer& gbuffer, const Raster& raster, bool emissive, int x, int y, std::size_t at) {
    const std::uint16_t* albedo = raster.albedo.data() + 4 * at;
    const float* emission = emissive ? raster.emission.data() + 4 * at : nullptr;
    return {spot_at(gbuffer, x, y),
            {glm::unpackHalf1x16(albedo[0]), glm::unpackHalf1x16(albedo[1]), glm::unpackHalf1x16(albedo[2])},
            emission != nullptr ? glm::vec3(emission[0], emission[1], emission[2]) : glm::vec3(0.0f)};
}

// Result: how well light of a pixel would do for a sample: 1 on the same surface, 0 where it faces away.
float similarity(const Spot& pixel, const Spot& sample, float width_m) {
    if (!(pixel.depth > 0.0f)) return 0.0f;
    const float cosine = glm::dot(pixel.normal, sample.normal);
    const float off = std::abs(glm::dot(pixel.normal, sample.position - pixel.position)) / width_m;
    return cosine >= kCosine && off <= kOffPlane ? 1.0f : 0.99f * std::max(cosine, 0.0f) / (1.0f + off);
}

bool one_material(const Shown& a, const Shown& b) {
    const glm::vec3 albedo = glm::abs(a.albedo - b.albedo), emission = glm::abs(a.emission_nit - b.emission_nit),
                    most = kEmissionStep * glm::max(a.emission_nit, b.emission_nit);
    return std::max({albedo.x, albedo.y, albedo.z}) < kAlbedoStep && emission.x <= most.x && emission.y <= most.y &&
           emission.z <= most.z;
}

// The eight neighbours, those nearest to a sample first.
struct Offset {
    std::int8_t dx, dy;
};
std::array<Offset, 8> neighbours(const glm::vec2& sample) {
    std::array<Offset, 8> list{{{-1, -1}, {0, -1}, {1, -1}, {-1, 0}, {1, 0}, {-1, 1}, {0, 1}, {1, 1}}};
    const auto far = [&](const Offset& o) {
        const glm::vec2 d = glm::vec2(o.dx, o.dy) - sample;
        return glm::dot(d, d);
    };
    std::stable_sort(list.begin(), list.end(), [&](const Offset& a, const Offset& b) { return far(a) < far(b); });
    return list;
}

// One row's pixels whose sample shows something else than their centre. Its seven parameters are two pictures and
// where.
void find(const GBuffer& gbuffer, const Raster& raster, const EdgeSamples& drawn, bool emissive, int y,
          const std::array<Offset, 8>& around, std::vector<EdgeSamples::Found>& found) {
    const std::size_t row = static_cast<std::size_t>(y) * gbuffer.row_length;
    for (int x = 0; x < gbuffer.width; ++x) {
        const std::size_t at = row + static_cast<std::size_t>(x);
        if (drawn.raster.nearest[at] == raster.nearest[at]) continue;
        if (found.size() >= kMostPerPixel * static_cast<std::size_t>(gbuffer.width)) return;
        EdgeSamples::Found one{static_cast<std::uint16_t>(x),
                               static_cast<std::uint8_t>(drawn.done),
                               0,
                               0,
                               drawn.raster.nearest[at] != 0,
                               {},
                               {}};
        if (one.surface) {
            const Shown sample = shown_at(drawn.gbuffer, drawn.raster, emissive, x, y, at),
                        centre = shown_at(gbuffer, raster, emissive, x, y, at);
            const float width_m = gbuffer.depth_per_pixel * sample.spot.depth;
            float best = similarity(centre.spot, sample.spot, width_m);
            if (best == 1.0f && raster.nearest[at] != kAnotherSurface && one_material(centre, sample)) continue;
            for (const Offset& o : around) {
                if (best == 1.0f) break;
                const int px = x + o.dx, py = y + o.dy;
                if (px < 0 || py < 0 || px >= gbuffer.width || py >= gbuffer.height) continue;
                const float here = similarity(spot_at(gbuffer, px, py), sample.spot, width_m);
                if (here > best) best = here, one.dx = o.dx, one.dy = o.dy;
            }
            one.albedo = sample.albedo;
            one.emission_nit = sample.emission_nit;
        }
        found.push_back(one);
    }
}

}  // namespace

glm::vec2 sample_offset(unsigned i, unsigned n) {
    std::uint32_t reversed = i;
    reversed = reversed << 16 | reversed >> 16;
    for (const auto& [shift, mask] : {std::pair(8, 0x00ff00ffu), {4, 0x0f0f0f0fu}, {2, 0x33333333u}, {1, 0x55555555u}})
        reversed = (reversed & mask) << shift | (reversed >> shift & mask);
    const float half = 0.5f / static_cast<float>(n);
    return {static_cast<float>(i) / static_cast<float>(n) + half - 0.5f,
            static_cast<float>(reversed) * 0x1p-32f + half - 0.5f};
}

void mark_others(const GBuffer& gbuffer, const GBuffer& drawn, Raster& raster, Pool& pool) {
    pool.run(gbuffer.height, [&](int y) {
        for (int x = 0; x < gbuffer.width; ++x) {
            const std::size_t at = static_cast<std::size_t>(y) * gbuffer.row_length + static_cast<std::size_t>(x);
            const float lit = gbuffer.depth[at], shown = drawn.depth[at];
            if (gbuffer.normal[at] == drawn.normal[at] && lit == shown) continue;
            const bool both = lit > 0.0f && shown > 0.0f;
            const float width_m = both ? gbuffer.depth_per_pixel * gbuffer.rays.near_m / lit : 1.0f;
            const bool one_surface = both ? similarity(spot_at(gbuffer, x, y), spot_at(drawn, x, y), width_m) == 1.0f
                                          : !(lit > 0.0f) && !(shown > 0.0f);
            if (!one_surface) raster.nearest[at] = kAnotherSurface;
        }
    });
}

bool add_edge_sample(const Clusters& clusters, const MaterialTable& materials, bool emissive, const GBuffer& gbuffer,
                     const Raster& raster, unsigned n, EdgeSamples& samples, Pool& pool) {
    const glm::vec2 offset = sample_offset(samples.done, n);
    GBuffer& drawn = samples.gbuffer;
    drawn.width = gbuffer.width, drawn.height = gbuffer.height, drawn.row_length = gbuffer.row_length;
    drawn.rays = gbuffer.rays;
    drawn.rays.corner += offset.x * gbuffer.rays.right + offset.y * gbuffer.rays.up;
    drawn.depth_per_pixel = gbuffer.depth_per_pixel;
    constexpr unsigned kPaneSamples = 16;  // of pass_threshold
    draw_gbuffer(clusters, materials, emissive, drawn, samples.raster, pool,
                 static_cast<int>(samples.done * kPaneSamples / n));
    samples.rows.resize(static_cast<std::size_t>(gbuffer.height));
    const std::array<Offset, 8> around = neighbours(offset);
    pool.run(gbuffer.height, [&](int y) {
        find(gbuffer, raster, samples, emissive, y, around, samples.rows[static_cast<std::size_t>(y)]);
    });
    return ++samples.done == n;
}

Edges edges_of(unsigned n, EdgeSamples& samples, Pool& pool) {
    const auto key = [](const EdgeSamples::Found& f) { return std::array<int, 4>{f.x, f.surface ? 0 : 1, f.dy, f.dx}; };
    pool.run(static_cast<int>(samples.rows.size()), [&](int y) {
        auto& row = samples.rows[static_cast<std::size_t>(y)];
        std::stable_sort(row.begin(), row.end(), [&](const auto& a, const auto& b) { return key(a) < key(b); });
    });
    Edges edges;
    const float share = 1.0f / static_cast<float>(n);
    for (std::size_t y = 0; y < samples.rows.size(); ++y) {
        edges.rows.push_back(static_cast<std::uint32_t>(edges.pixels.size()));
        const EdgeSamples::Found* before = nullptr;
        for (const EdgeSamples::Found& found : samples.rows[y]) {
            if (before == nullptr || before->x != found.x) {
                edges.others.push_back(0);
                edges.pixels.push_back({found.x, static_cast<std::uint32_t>(edges.taps.size()), 0, 1.0f, {}});
            }
            edges.others.back() |= std::uint64_t{1} << found.sample;
            layouts::EdgePixel& pixel = edges.pixels.back();
            if (before == nullptr || key(*before) != key(found)) {
                const auto tap_x = static_cast<std::uint32_t>(found.x + found.dx),
                           tap_y = static_cast<std::uint32_t>(static_cast<int>(y) + found.dy);
                edges.taps.push_back({glm::vec4(0.0f), found.surface ? tap_x : GONIO_NO_PIXEL, tap_y, 0, 0});
                ++pixel.count;
            }
            edges.taps.back().albedo_share += glm::vec4(found.albedo, 1.0f) * share;
            pixel.emission_nit += glm::vec4(found.emission_nit, 0.0f) * share;
            pixel.own -= share;
            before = &found;
        }
    }
    edges.rows.push_back(static_cast<std::uint32_t>(edges.pixels.size()));
    for (layouts::EdgePixel& pixel : edges.pixels) pixel.own = std::max(pixel.own, 0.0f);
    samples = {};
    return edges;
}

}  // namespace gonio::lighting
