#include "server/lighting/antialias.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/packing.hpp>
#include <optional>

#include "shaders/lib/as_cpp.h"

namespace gonio::lighting {
namespace {

// Two points are on one surface where one is no further off the other's plane than this share of a pixel's width, and
// the cosine between their normals is no less.
constexpr float kOffPlane = 0.5f, kCosine = 0.8f;
// Direct light of a sample is its own where the cosine to the surface whose light it takes is less, or that is less
// alike.
constexpr float kOwnLightCosine = 0.97f, kLeastSimilar = 0.5f;
constexpr std::size_t kMostPerPixel = 4;

// Result: how well light of a pixel would do for a sample: 1 on the same surface, 0 where it faces away.
float similarity(const Spot& pixel, const Spot& sample, float width_m) {
    if (!(pixel.depth > 0.0f)) return 0.0f;
    const float cosine = glm::dot(pixel.normal, sample.normal);
    const float off = std::abs(glm::dot(pixel.normal, sample.position - pixel.position)) / width_m;
    return cosine >= kCosine && off <= kOffPlane ? 1.0f : 0.99f * std::max(cosine, 0.0f) / (1.0f + off);
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

// What a sample looks like, to the sums of `count` pixels from `at` on.
void add_look(EdgeSamples& samples, bool emissive, std::size_t at, std::size_t count) {
    add_halves(samples.raster.albedo.data() + 4 * at, 4 * count, samples.albedo.data() + 4 * at);
    for (std::size_t i = 4 * at; emissive && i < 4 * (at + count); ++i)
        samples.emission[i] += samples.raster.emission[i];
}

// Keeps a sample of pixel (x, y) for its own direct light, or with an earlier one on the same surface. Result: false:
// its row has too many.
bool add_point(EdgeSamples& drawn, int x, int y, const Spot& sample, bool in_mean, const glm::vec3& albedo) {
    std::vector<EdgeSamples::Point>& points = drawn.points[static_cast<std::size_t>(y)];
    std::uint32_t& newest =
        drawn.newest_point[static_cast<std::size_t>(y) * drawn.gbuffer.row_length + static_cast<std::size_t>(x)];
    const glm::vec3 normal = lit_normal_at(drawn.gbuffer, x, y);
    const float weight = std::max(glsl::luminance(albedo), 1e-4f),
                off_m = kOffPlane * drawn.gbuffer.depth_per_pixel * sample.depth;
    for (std::uint32_t i = newest; i != 0; i = points[i - 1].before) {
        EdgeSamples::Point& known = points[i - 1];
        if (known.in_mean != in_mean || glm::dot(known.point.normal, normal) < kOwnLightCosine ||
            std::abs(glm::dot(known.point.normal, sample.position - known.point.position)) > off_m)
            continue;
        known.point.albedo += weight;
        return true;
    }
    if (points.size() >= kMostPerPixel * static_cast<std::size_t>(drawn.gbuffer.width)) return false;
    points.push_back({static_cast<std::uint16_t>(x), in_mean, newest, {sample.position, normal, sample.depth, weight}});
    newest = static_cast<std::uint32_t>(points.size());
    return true;
}

// Keeps what was found in a pixel, with an earlier one that takes the same light. newest: of the pixel. Result: false:
// its row has too many.
bool keep(std::vector<EdgeSamples::Found>& row, std::uint32_t& newest, std::size_t most, EdgeSamples::Found one) {
    for (std::uint32_t i = newest; i != 0; i = row[i - 1].before) {
        EdgeSamples::Found& known = row[i - 1];
        if (known.surface != one.surface || known.dx != one.dx || known.dy != one.dy) continue;
        known.samples |= one.samples;
        known.count += one.count;
        known.albedo += one.albedo;
        known.emission_nit += one.emission_nit;
        return true;
    }
    if (row.size() >= most) return false;
    one.before = newest;
    row.push_back(one);
    newest = static_cast<std::uint32_t>(row.size());
    return true;
}

// Result: a sample of pixel (x, y), which shows another triangle than the centre; none where it is on the same surface.
std::optional<EdgeSamples::Found> other_surface(const GBuffer& gbuffer, EdgeSamples& drawn, bool emissive, int x, int y,
                                                const std::array<Offset, 8>& around) {
    const std::size_t at = static_cast<std::size_t>(y) * gbuffer.row_length + static_cast<std::size_t>(x);
    EdgeSamples::Found one;
    one.x = static_cast<std::uint16_t>(x);
    one.samples = std::uint64_t{1} << drawn.done;
    if (drawn.raster.nearest[at] == 0) return one;
    const Spot sample = spot_at(drawn.gbuffer, x, y);
    const float width_m = gbuffer.depth_per_pixel * sample.depth;
    const Spot centre = spot_at(gbuffer, x, y);
    float best = similarity(centre, sample, width_m);
    for (int k = 0; k < 3; ++k) {
        const std::size_t value = 4 * at + static_cast<std::size_t>(k);
        one.albedo[k] = glm::unpackHalf1x16(drawn.raster.albedo[value]);
        if (emissive) one.emission_nit[k] = drawn.raster.emission[value];
    }
    if (best == 1.0f) {
        if (glm::dot(centre.normal, sample.normal) < kOwnLightCosine) add_point(drawn, x, y, sample, true, one.albedo);
        return std::nullopt;
    }
    for (const Offset& o : around) {
        if (best == 1.0f) break;
        const int px = x + o.dx, py = y + o.dy;
        if (px < 0 || py < 0 || px >= gbuffer.width || py >= gbuffer.height) continue;
        const float here = similarity(spot_at(gbuffer, px, py), sample, width_m);
        if (here > best) best = here, one.dx = o.dx, one.dy = o.dy;
    }
    one.surface = true;
    if (best < kLeastSimilar && add_point(drawn, x, y, sample, false, one.albedo)) one.dx = one.dy = 0;
    return one;
}

// One row's pixels: what of the sample is on the surface of their centre goes to their sums, the others are found. Its
// six parameters are two pictures and where.
void find(const GBuffer& gbuffer, const Raster& raster, EdgeSamples& drawn, bool emissive, int y,
          const std::array<Offset, 8>& around) {
    std::vector<EdgeSamples::Found>& found = drawn.rows[static_cast<std::size_t>(y)];
    const std::size_t row = static_cast<std::size_t>(y) * gbuffer.row_length,
                      end = row + static_cast<std::size_t>(gbuffer.width);
    const std::size_t most = kMostPerPixel * static_cast<std::size_t>(gbuffer.width);
    std::size_t first = row;  // of the pixels that wait to be added
    for (std::size_t at = row; at < end; ++at) {
        if (drawn.raster.nearest[at] == raster.nearest[at]) continue;
        if (found.size() >= most && drawn.newest[at] == 0) continue;
        const auto other = other_surface(gbuffer, drawn, emissive, static_cast<int>(at - row), y, around);
        if (!other || !keep(found, drawn.newest[at], most, *other)) continue;
        add_look(drawn, emissive, first, at - first);
        first = at + 1;
    }
    add_look(drawn, emissive, first, end - first);
}

// Of row y, whose `albedo` are sums still.
void mix_points(EdgeSamples& samples, int y, Edges& edges) {
    std::vector<EdgeSamples::Point>& all = samples.points[static_cast<std::size_t>(y)];
    std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.x < b.x; });
    std::vector<Edges::Mixed>& mixed = edges.mixed[static_cast<std::size_t>(y)];
    std::vector<Edges::Point>& points = edges.points[static_cast<std::size_t>(y)];
    for (const auto& [x, in_mean, before, point] : all) {
        if (mixed.empty() || mixed.back().x != x) {
            const std::size_t at = static_cast<std::size_t>(y) * samples.gbuffer.row_length + x;
            const float* sum = samples.albedo.data() + 4 * at;
            mixed.push_back(
                {x, static_cast<std::uint32_t>(points.size()), 0, glsl::luminance(glm::vec3(sum[0], sum[1], sum[2]))});
        }
        Edges::Mixed& pixel = mixed.back();
        ++pixel.count;
        if (in_mean) pixel.albedo = std::max(pixel.albedo - point.albedo, 0.0f);
        points.push_back(point);
    }
}

// Sums -> means, of a row from `at` on. Result: of the reflectance, whose last value is 1 where there is a mean.
void to_means(EdgeSamples& samples, std::size_t at, std::size_t row_length, std::uint16_t* albedo) {
    for (std::size_t i = 4 * at; i < 4 * (at + row_length); i += 4) {
        const float count = samples.albedo[i + 3], each = count > 0.0f ? 1.0f / count : 0.0f;
        for (std::size_t k = i; k < i + 4; ++k) {
            samples.albedo[k] *= each;
            if (!samples.emission.empty()) samples.emission[k] *= each;
        }
    }
    to_halves(samples.albedo.data() + 4 * at, 4 * row_length, albedo + 4 * at);
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
                     const Raster& raster, unsigned n, EdgeSamples& samples, Pool& pool, const PosedBodies* bodies) {
    const glm::vec2 offset = sample_offset(samples.done, n);
    GBuffer& drawn = samples.gbuffer;
    drawn.width = gbuffer.width, drawn.height = gbuffer.height, drawn.row_length = gbuffer.row_length;
    drawn.rays = gbuffer.rays;
    drawn.rays.corner += offset.x * gbuffer.rays.right + offset.y * gbuffer.rays.up;
    drawn.depth_per_pixel = gbuffer.depth_per_pixel;
    draw_gbuffer(clusters, materials, emissive, drawn, samples.raster, pool,
                 {static_cast<int>(samples.done), static_cast<int>(n), 1.0f / static_cast<float>(n)}, bodies);
    samples.rows.resize(static_cast<std::size_t>(gbuffer.height));
    samples.points.resize(samples.rows.size());
    samples.newest.resize(drawn.depth.size());
    samples.newest_point.resize(drawn.depth.size());
    samples.albedo.resize(samples.raster.albedo.size());
    samples.emission.resize(samples.raster.emission.size());
    const std::array<Offset, 8> around = neighbours(offset);
    pool.run(gbuffer.height, [&](int y) { find(gbuffer, raster, samples, emissive, y, around); });
    return ++samples.done == n;
}

Edges edges_of(unsigned n, EdgeSamples& samples, Pool& pool) {
    Edges edges;
    edges.albedo.resize(samples.albedo.size());
    edges.mixed.resize(samples.rows.size());
    edges.points.resize(samples.rows.size());
    const auto key = [](const EdgeSamples::Found& f) { return std::array<int, 4>{f.x, f.surface ? 0 : 1, f.dy, f.dx}; };
    pool.run(static_cast<int>(samples.rows.size()), [&](int y) {
        auto& row = samples.rows[static_cast<std::size_t>(y)];
        std::stable_sort(row.begin(), row.end(), [&](const auto& a, const auto& b) { return key(a) < key(b); });
        mix_points(samples, y, edges);
        const std::size_t row_length = samples.gbuffer.row_length;
        to_means(samples, static_cast<std::size_t>(y) * row_length, row_length, edges.albedo.data());
    });
    edges.emission = std::move(samples.emission);
    const float share = 1.0f / static_cast<float>(n);
    for (std::size_t y = 0; y < samples.rows.size(); ++y) {
        edges.rows.push_back(static_cast<std::uint32_t>(edges.pixels.size()));
        const EdgeSamples::Found* before = nullptr;
        for (const EdgeSamples::Found& found : samples.rows[y]) {
            if (before == nullptr || before->x != found.x) {
                edges.others.push_back(0);
                edges.pixels.push_back({found.x, static_cast<std::uint32_t>(edges.taps.size()), 0, 1.0f, {}});
            }
            edges.others.back() |= found.samples;
            layouts::EdgePixel& pixel = edges.pixels.back();
            if (before == nullptr || key(*before) != key(found)) {
                const auto tap_x = static_cast<std::uint32_t>(found.x + found.dx),
                           tap_y = static_cast<std::uint32_t>(static_cast<int>(y) + found.dy);
                edges.taps.push_back({glm::vec4(0.0f), found.surface ? tap_x : GONIO_NO_PIXEL, tap_y, 0, 0});
                ++pixel.count;
            }
            edges.taps.back().albedo_share += glm::vec4(found.albedo, static_cast<float>(found.count)) * share;
            pixel.emission_nit += glm::vec4(found.emission_nit, 0.0f) * share;
            pixel.own -= static_cast<float>(found.count) * share;
            before = &found;
        }
    }
    edges.rows.push_back(static_cast<std::uint32_t>(edges.pixels.size()));
    for (layouts::EdgePixel& pixel : edges.pixels) pixel.own = std::max(pixel.own, 0.0f);
    samples = {};
    return edges;
}

}  // namespace gonio::lighting
