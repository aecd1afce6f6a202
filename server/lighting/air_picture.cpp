#include "server/lighting/air_picture.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "server/lighting/kernels.h"
#include "server/lighting/layers.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/lighting/air_picture.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

// After the two above: once for each instruction set.
#include <hwy/contrib/math/math-inl.h>

#ifndef GONIO_LIGHTING_AIR_PICTURE_ROWS
#define GONIO_LIGHTING_AIR_PICTURE_ROWS
namespace gonio::lighting {

// Two rows of a view's points around a row of pixels, the outermost values repeated beyond their ends: rgb, and 1 /
// distance. Point k is number k + 1.
struct PointRows {
    const float* below[4];
    const float* above[4];
    float up = 0.0f;  // how far the row is from the lower to the upper ones, 0 … 1
};
}  // namespace gonio::lighting
#endif

HWY_BEFORE_NAMESPACE();
namespace gonio::lighting {
namespace HWY_NAMESPACE {

#include "server/lighting/simd.h"
#include "server/lighting/simd_air.h"
#include "server/lighting/simd_layers.h"
#include "server/lighting/simd_pixels.h"

// Row y: what of light behind the haze passes; nothing where no surface is.
void PassesRow(const GBuffer& s, const Air& air, int y, float* out) {
    const glm::vec3 start = s.rays.corner + static_cast<float>(y) * s.rays.up;
    const std::size_t row = static_cast<std::size_t>(y) * s.row_length;
    const Tag tag;
    for (std::size_t x = 0; x < s.row_length; x += hn::Lanes(tag)) {
        const Float depth = load(s.depth.data() + row + x), z = Float(s.rays.near_m) / max(depth, Float(1e-30f)),
                    column = hn::ConvertTo(tag, hn::Iota(IntTag(), static_cast<int>(x)));
        const Vec3 ray(Float(start.x) + column * Float(s.rays.right.x), Float(start.y) + column * Float(s.rays.right.y),
                       Float(start.z) + column * Float(s.rays.right.z));
        const Float length = sqrt(dot(ray, ray)) * z;
        const Float passed = air_passes(air, length, Float(s.rays.eye.y), Float(s.rays.eye.y) + ray.y * z);
        store(mix(Float(0.0f), passed, Float(0.0f) < depth), out + x);
    }
}

// A row of rgb: of the four points around a pixel, which stand kStep apart, those that are as far away. depth:
// GBuffer's of the row; four vectors of pixels kStep apart at a time.
void BetweenRow(const float* depth, float near_m, const PointRows& points, std::size_t length, float* const* out) {
    static_assert(kStep == 4);
    const Tag tag;
    for (std::size_t k = 0; 4 * k < length; k += hn::Lanes(tag)) {
        Raw depths[4], rgb[3][4];
        hn::LoadInterleaved4(tag, depth + 4 * k, depths[0], depths[1], depths[2], depths[3]);
        for (int phase = 0; phase < 4; ++phase) {
            const std::ptrdiff_t left = static_cast<std::ptrdiff_t>(k) + 1 + left_of(phase);
            const float across = 0.25f * static_cast<float>(phase < 2 ? phase + 2 : phase - 2);
            const Float own = Float(depths[phase]) * Float(1.0f / near_m);  // 1 / depth
            Float sum(0.0f), value[3];
            for (int corner = 0; corner < 4; ++corner) {
                const float* const* row = corner < 2 ? points.below : points.above;
                const std::ptrdiff_t at = left + corner % 2;
                const Float other = load(row[3] + at), unlike = abs(own - other) / max(max(own, other), Float(1e-9f));
                const float even =
                    (corner % 2 == 0 ? 1.0f - across : across) * (corner < 2 ? 1.0f - points.up : points.up);
                const Float weight = Float(even) / (Float(0.02f) + unlike);
                sum = sum + weight;
                for (int c = 0; c < 3; ++c) value[c] = value[c] + weight * load(row[c] + at);
            }
            const Float per_sum = Float(1.0f) / max(sum, Float(1e-20f));
            for (int c = 0; c < 3; ++c) rgb[c][phase] = (value[c] * per_sum).raw;
        }
        for (int c = 0; c < 3; ++c)
            hn::StoreInterleaved4(rgb[c][0], rgb[c][1], rgb[c][2], rgb[c][3], tag, out[c] + 4 * k);
    }
}

// A row of rgb × scale and what passes -> 4 half floats a pixel. keeps: what passes is there.
void PackRow(const float* const* row, float scale, std::size_t length, bool keeps, std::uint16_t* to) {
    for (std::size_t x = 0; x < length; x += hn::Lanes(Tag())) {
        const auto light = [&](int k) { return to_half(load(row[k] + x) * Float(scale)); };
        hn::Vec<HalfBits> before[3], passes;
        if (keeps)
            hn::LoadInterleaved4(HalfBits(), to + 4 * x, before[0], before[1], before[2], passes);
        else
            passes = to_half(load(row[3] + x));
        hn::StoreInterleaved4(light(0), light(1), light(2), passes, HalfBits(), to + 4 * x);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace gonio::lighting
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gonio::lighting {

HWY_EXPORT(PassesRow);
HWY_EXPORT(BetweenRow);
HWY_EXPORT(PackRow);

namespace {

// Result: by how much GBuffer::depth grows from a pixel to the next, `step` apart in it: on a plane it is even. Of the
// two sides the flatter one, because the other may lie beyond an edge.
float depth_slope(const GBuffer& s, std::size_t at, std::size_t step, bool has_before, bool has_after) {
    const float own = s.depth[at], before = has_before ? own - s.depth[at - step] : 0.0f,
                after = has_after ? s.depth[at + step] - own : 0.0f;
    if (!has_before || !has_after) return before + after;
    return std::abs(before) < std::abs(after) ? before : after;
}

// A ray of a pixel, as number i. off: from its middle, pixels; wide_rad: AirRays::pixel_rad.
void set_ray(const GBuffer& s, int x, int y, const glm::vec2& off, float far_m, float shift_ratio, float wide_rad,
             std::size_t i, AirRays& rays) {
    const glm::vec3 ray =
        s.rays.corner + (static_cast<float>(x) + off.x) * s.rays.right + (static_cast<float>(y) + off.y) * s.rays.up;
    const float length = glm::length(ray);
    const std::size_t at = static_cast<std::size_t>(y) * s.row_length + static_cast<std::size_t>(x);
    float depth = s.depth[at];
    if (off != glm::vec2(0.0f) && depth > 0.0f)  // behind the surface there may be a luminaire
        depth = std::max(depth + off.x * depth_slope(s, at, 1, x > 0, x + 1 < s.width) +
                             off.y * depth_slope(s, at, s.row_length, y > 0, y + 1 < s.height),
                         0.5f * depth);
    rays.set(i, s.rays.eye, ray / length, depth > 0.0f ? length * s.rays.near_m / depth : far_m, shift_ratio, wide_rad);
}
// Sixteen places in a step, neighbours far apart (Bayer 1973).
float shift_at(int column, int row) {
    constexpr float kShifts[4][4] = {{0, 8, 2, 10}, {12, 4, 14, 6}, {3, 11, 1, 9}, {15, 7, 13, 5}};
    return (kShifts[row & 3][column & 3] + 0.5f) / 16.0f;
}
float pixel_rad(const GBuffer& s) {
    return glm::length(s.rays.right) / glm::length(s.rays.corner + 0.5f * (static_cast<float>(s.width) * s.rays.right +
                                                                           static_cast<float>(s.height) * s.rays.up));
}
// The pixel whose ray number `at` of a view's columns, or rows, is; length: of the picture.
int pixel_of(const AirView& view, int at, int length) {
    return std::min(at * view.step + view.step / 2, length - 1);
}

// The rows of points below and above a row of pixels.
struct RowsAround {
    int below, above;
    float up;  // PointRows
};
RowsAround rows_around(const AirView& view, int y) {
    const float place = std::clamp((static_cast<float>(y) - 2.0f) / kStep, 0.0f, static_cast<float>(view.height - 1));
    const int below = static_cast<int>(place);
    return {below, std::min(below + 1, view.height - 1), place - static_cast<float>(below)};
}

// Points of a view from a row on, with a border: rgb and 1 / distance.
struct BorderedPoints {
    int first_row;
    std::size_t stride;
    std::vector<float> values;

    void resize(const AirView& view, int first, int rows) {
        first_row = first, stride = static_cast<std::size_t>(view.width) + 2 + kSimdWidth;
        values.resize(4 * stride * static_cast<std::size_t>(rows));
    }
    float* row_of(int row, std::size_t k) {
        return values.data() + (4 * static_cast<std::size_t>(row - first_row) + k) * stride;
    }
    // planes: rgb in the shape of the view.
    void set(const GBuffer& s, const AirView& view, const std::array<const float*, 3>& planes, int row) {
        const auto y = static_cast<std::size_t>(pixel_of(view, row, s.height)),
                   width = static_cast<std::size_t>(view.width), first = static_cast<std::size_t>(row) * width;
        for (std::size_t k = 0; k < 3; ++k) std::copy_n(planes[k] + first, width, row_of(row, k) + 1);
        for (std::size_t column = 0; column < width; ++column) {
            const auto x = static_cast<std::size_t>(pixel_of(view, static_cast<int>(column), s.width));
            row_of(row, 3)[column + 1] = s.depth[y * s.row_length + x] / s.rays.near_m;
        }
        for (std::size_t k = 0; k < 4; ++k) {
            float* const to = row_of(row, k);
            to[0] = to[1];
            std::fill(to + width + 1, to + stride, to[width]);
        }
    }
};
// Of a row of pixels those from `first`, a multiple of 4·kSimdWidth, to `end`.
void between_row(const GBuffer& s, const AirView& view, BorderedPoints& points, int y, std::size_t first,
                 std::size_t end, float* const* out) {
    const RowsAround rows = rows_around(view, y);
    PointRows around;
    for (std::size_t k = 0; k < 4; ++k) {
        around.below[k] = points.row_of(rows.below, k) + first / kStep;
        around.above[k] = points.row_of(rows.above, k) + first / kStep;
    }
    around.up = rows.up;
    HWY_DYNAMIC_DISPATCH(BetweenRow)
    (s.depth.data() + static_cast<std::size_t>(y) * s.row_length + first, s.rays.near_m, around, end - first, out);
}

void airlight_of_all(const AirlightSource& source, const AirRays& rays, unsigned samples, std::size_t chunk, float* out,
                     Pool& pool) {
    pool.run_chunks(rays.size() / kSimdWidth, chunk, [&](std::size_t first, std::size_t size) {
        airlight(source, rays, first * kSimdWidth, size * kSimdWidth, samples, out + first * kSimdWidth);
    });
}

// Where a luminaire is in the picture, pixels; none behind the eye or beside it.
std::optional<glm::vec2> place_of(const GBuffer& s, const glm::vec3& light) {
    const glm::vec3 at = glm::inverse(glm::mat3(s.rays.right, s.rays.up, s.rays.corner)) * (light - s.rays.eye);
    if (!(at.z > 0.0f)) return std::nullopt;
    const glm::vec2 place = glm::vec2(at) / at.z;
    // NaN is beside the picture too.
    constexpr float kHalf = NearAir::kHalf_px;
    const bool shown = place.x > -kHalf && place.x < static_cast<float>(s.width) + kHalf && place.y > -kHalf &&
                       place.y < static_cast<float>(s.height) + kHalf;
    return shown ? std::optional(place) : std::nullopt;
}

// Result: the means of the airlight over the pixels of a square about the luminaire, which is at `place`.
std::vector<float> means_near(const GBuffer& s, const AirView& view, const AirlightSource& source, unsigned samples,
                              const NearAir& near, const glm::vec2& place, Pool& pool) {
    struct Pixel {
        int x, y, side;  // so many rays a side: about the luminaire its web is seen from all around
    };
    std::vector<Pixel> pixels;
    std::size_t count = 0;
    for (int y = near.y; y < near.y + near.height; ++y)
        for (int x = near.x; x < near.x + near.width; ++x) {
            const glm::vec2 off = glm::abs(glm::vec2(x, y) - place);
            const float most = std::max(off.x, off.y);
            const int side = most < 2.5f ? 4 : most < 5.5f ? 2 : 1;
            pixels.push_back({x, y, side});
            count += static_cast<std::size_t>(side * side);
        }
    AirRays rays;
    rays.resize(count);
    const float wide_rad = pixel_rad(s);
    count = 0;
    for (const auto& [x, y, side] : pixels)
        for (int k = 0; k < side * side; ++k) {
            const glm::vec2 off = (glm::vec2(k % side, k / side) + 0.5f) / static_cast<float>(side) - 0.5f;
            set_ray(s, x, y, off, view.far_m, shift_at(x + k % side, y + k / side), wide_rad / static_cast<float>(side),
                    count++, rays);
        }
    std::vector<float> found(rays.size()), means;
    airlight_of_all(source, rays, samples, 16, found.data(), pool);
    count = 0;
    for (const Pixel& pixel : pixels) {
        const int own = pixel.side * pixel.side;
        float sum = 0.0f;
        for (int k = 0; k < own; ++k) sum += found[count++];
        means.push_back(sum / static_cast<float>(own));
    }
    return means;
}

// A ray by a luminaire sees it from all of π: forward peaks of the phase function are a few such steps wide.
constexpr unsigned kNearSamples = 21;

void find_near(const GBuffer& s, const AirView& view, const AirlightSource& source, unsigned samples, Beam& beam,
               Pool& pool) {
    NearAir& near = beam.near;
    near.width = near.height = 0, near.most = 0.0f;
    const auto place = place_of(s, source.light.position);
    if (!place) return;
    const glm::ivec2 middle(glm::floor(*place + 0.5f)),
        low = glm::max(middle - NearAir::kHalf_px, 0),
        high = glm::min(middle + NearAir::kHalf_px, glm::ivec2(s.width, s.height));
    if (low.x >= high.x || low.y >= high.y) return;
    near.x = low.x, near.y = low.y, near.width = high.x - low.x, near.height = high.y - low.y;
    near.values = means_near(s, view, source, std::max(samples, kNearSamples), near, *place, pool);
    const auto width = static_cast<std::size_t>(near.width), height = static_cast<std::size_t>(near.height);
    // What comes to each of the view's rays.
    const bool grid = view.step > 1;
    BorderedPoints points;
    if (grid) {
        const int first_row = rows_around(view, low.y).below, end_row = rows_around(view, high.y - 1).above + 1;
        points.resize(view, first_row, end_row - first_row);
        const float* const plane = beam.rays.data();
        for (int row = first_row; row < end_row; ++row) points.set(s, view, {plane, plane, plane}, row);
    }
    std::vector<float> row(3 * s.row_length);
    float* const between[3] = {row.data(), row.data() + s.row_length, row.data() + 2 * s.row_length};
    const std::size_t first = static_cast<std::size_t>(low.x) / (4 * kSimdWidth) * (4 * kSimdWidth);
    for (std::size_t j = 0; j < height; ++j) {
        const int y = low.y + static_cast<int>(j);
        if (grid) between_row(s, view, points, y, first, static_cast<std::size_t>(high.x), between);
        const float* const others = grid ? between[0] - first : beam.rays.data() + std::size_t{1} * y * view.width;
        for (std::size_t i = 0; i < width; ++i) {
            const int x = low.x + static_cast<int>(i);
            const glm::vec2 off = glm::abs(glm::vec2(x, y) - *place);
            // In the outer quarter of the square.
            const float fade = std::clamp(4.0f - 4.0f * std::max(off.x, off.y) / NearAir::kHalf_px, 0.0f, 1.0f);
            float& value = near.values[j * width + i];
            value = fade * (value - others[x]);
            near.most = std::max(near.most, value);
        }
    }
}

// rows: rgb of a row of pixels.
void add_near(const NearAir& near, const glm::vec3& weight, int y, float* const* rows) {
    if (y < near.y || y >= near.y + near.height) return;
    const auto width = static_cast<std::size_t>(near.width);
    const float* const values = near.values.data() + static_cast<std::size_t>(y - near.y) * width;
    for (int k = 0; k < 3; ++k)
        for (std::size_t i = 0; i < width; ++i) {
            float& value = rows[k][static_cast<std::size_t>(near.x) + i];
            value = std::max(value + weight[k] * values[i], 0.0f);
        }
}

}  // namespace

void look_into_air(const GBuffer& s, int step, float far_m, AirView& view, Pool& pool) {
    view.step = step, view.far_m = far_m;
    view.width = (s.width + step - 1) / step, view.height = (s.height + step - 1) / step;
    view.rays.resize(view.size());
    const float wide_rad = pixel_rad(s);
    pool.run(view.height, [&](int row) {
        for (int column = 0; column < view.width; ++column)
            set_ray(s, pixel_of(view, column, s.width), pixel_of(view, row, s.height), glm::vec2(0.0f), far_m,
                    shift_at(column, row), wide_rad, static_cast<std::size_t>(row * view.width + column), view.rays);
    });
}

void beam_of(const GBuffer& s, const AirView& view, const AirlightSource& source, unsigned samples, Beam& out,
             Pool& pool) {
    out.rays.resize(view.rays.size());
    airlight_of_all(source, view.rays, samples, 32, out.rays.data(), pool);
    find_near(s, view, source, samples, out, pool);
}

void show_air(const GBuffer& s, const Air& air, const AirView& view, const AirLight& light,
              const std::array<std::uint64_t, 2>& passes_of, AirPicture& picture, Pool& pool) {
    constexpr float kGreatest = 1000.0f;  // of the half floats: they hold the rest to 2^-24 of it
    float most[3] = {};
    pool.run(3, [&](int k) {
        for (const float value : light.planes[static_cast<std::size_t>(k)]) most[k] = std::max(most[k], value);
    });
    float nearest = 0.0f;
    for (const AirLight::Near& near : light.near)
        nearest = std::max(nearest, near.air->most * std::max({near.weight.x, near.weight.y, near.weight.z}));
    const float greatest = std::max({most[0], most[1], most[2]}) + nearest;
    picture.unit = std::isfinite(greatest) && greatest > 1e-30f ? greatest / kGreatest : 1.0f;
    const bool keeps = picture.halves.size() == 4 * s.depth.size() && picture.passes_of == passes_of;
    picture.halves.resize(4 * s.depth.size());
    picture.passes_of = passes_of;
    const bool between = view.step > 1;
    static thread_local BorderedPoints kept;
    BorderedPoints& points = kept;  // this thread's, in jobs too
    points.resize(view, 0, between ? view.height : 0);
    const std::array<const float*, 3> planes = {light.planes[0].data(), light.planes[1].data(), light.planes[2].data()};
    pool.run(between ? view.height : 0, [&](int row) { points.set(s, view, planes, row); });
    pool.run(s.height, [&](int y) {
        static thread_local std::vector<float> row;
        row.resize(4 * s.row_length);
        float* const out[4] = {row.data(), row.data() + s.row_length, row.data() + 2 * s.row_length,
                               row.data() + 3 * s.row_length};
        if (between)
            between_row(s, view, points, y, 0, static_cast<std::size_t>(view.width) * kStep, out);
        else
            for (std::size_t k = 0; k < 3; ++k)
                std::copy_n(planes[k] + std::size_t{1} * y * view.width, view.width, out[k]);
        for (const AirLight::Near& near : light.near) add_near(*near.air, near.weight, y, out);
        if (!keeps) HWY_DYNAMIC_DISPATCH(PassesRow)(s, air, y, out[3]);
        HWY_DYNAMIC_DISPATCH(PackRow)
        (out, 1.0f / picture.unit, s.row_length, keeps,
         picture.halves.data() + 4 * static_cast<std::size_t>(y) * s.row_length);
    });
}

}  // namespace gonio::lighting
#endif
