#include "server/lighting/airlight.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "server/lighting/layers.h"
#include "shaders/shared/layouts.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/lighting/airlight.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

// After the two above: once for each instruction set.
#include <hwy/contrib/math/math-inl.h>

#ifndef GONIO_LIGHTING_AIRLIGHT_ROWS
#define GONIO_LIGHTING_AIRLIGHT_ROWS
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
#include "server/lighting/simd_web.h"

// Of a ray, from begin to end, m.
struct Part {
    Float begin, end;
};
HWY_INLINE Part common(const Part& a, const Part& b) {
    const Float begin = max(a.begin, b.begin);
    return {begin, max(min(a.end, b.end), begin)};
}
// The part of a ray within the cone about the light's axis, -z of its frame, of a half-angle below 90° with this
// cosine. w: from the light to the ray's start; d: the ray's direction, unit.
HWY_INLINE Part within_cone(const Vec3& w, const Vec3& d, float cosine, const Part& whole) {
    const Float c2(cosine * cosine), a = d.z * d.z - c2, b = d.z * w.z - c2 * dot(w, d), c = w.z * w.z - c2 * dot(w, w);
    const Float safe = mix(a, mix(Float(1e-7f), Float(-1e-7f), a < Float(0.0f)), abs(a) < Float(1e-7f));
    const Float root = sqrt(max(b * b - safe * c, Float(0.0f))), one = (-b - root) / safe, two = (root - b) / safe;
    const Float low = min(one, two), high = max(one, two), far(3e30f);
    const Mask narrow = safe < Float(0.0f), misses = b * b < safe * c, away = Float(0.0f) < d.z;
    // A ray steeper than the cone is in it from one of the two on, or up to it; another one between them.
    const Float middle = (low + high) * Float(0.5f);
    const Mask behind = Float(0.0f) < w.z + d.z * middle;
    const Float begin = mix(mix(high, -far, away), mix(low, far, hn::Or(misses, behind)), narrow),
                end = mix(mix(far, low, away), high, narrow);
    return common(whole, {begin, end});
}

// 1 where a map's light reaches p, at distance r; between texels as many of the four as are further away.
HWY_INLINE Float reaches(const DistanceMap& map, const Vec3& p, Float r) {
    const Tag tag;
    const IntTag ints;
    const Float per_r = Float(1.0f) / max(r, Float(1e-6f)), half(0.5f * static_cast<float>(map.side)),
                k = inversesqrt(max((Float(1.0f) - p.z * per_r) * Float(map.spread), Float(1e-6f))) * per_r * half;
    const Float last(static_cast<float>(map.side) - 1.001f);
    const auto place = [&](Float x) { return min(max(x * k + half - Float(0.5f), Float(0.0f)), last); };
    const Float x = place(p.x), y = place(p.y);
    const auto column = hn::ConvertTo(ints, x.raw), row = hn::ConvertTo(ints, y.raw);
    const auto at = hn::Add(hn::Mul(row, hn::Set(ints, map.side)), column);
    const Float a = x - Float(hn::ConvertTo(tag, column)), b = y - Float(hn::ConvertTo(tag, row)),
                near = r * Float(0.997f);
    const auto open = [&](int off) {
        const Float far(hn::GatherIndex(tag, map.metres.data() + off, at));
        return mix(Float(0.0f), Float(1.0f), near < far);
    };
    const Float lower = open(0) + (open(1) - open(0)) * a,
                upper = open(map.side) + (open(map.side + 1) - open(map.side)) * a;
    return lower + (upper - lower) * b;
}

// Sixteen rays, as a luminaire's frame has them; heights are of the world.
struct Bundle {
    Vec3 w, d;
    Float y, dy, shift;
};

// What `samples` places in a part of the rays scatter to their start.
HWY_INLINE Float scattered(const AirlightSource& source, const Bundle& ray, const Part& part, unsigned samples) {
    constexpr float kLeast_m = 1e-3f;  // a ray through a luminaire comes no nearer
    const Tag tag;
    const Air& air = source.light.air;
    const Float b = -dot(ray.w, ray.d);
    const Vec3 foot = ray.w + ray.d * b;
    const Float h = max(sqrt(dot(foot, foot)), Float(kLeast_m));
    const Float first = atan(part.begin - b, h), last = atan(part.end - b, h),
                step = (last - first) * Float(1.0f / static_cast<float>(samples)), start = first + step * Float(0.5f),
                aside = step * (ray.shift - Float(0.5f));
    Float cosine = hn::Cos(tag, start.raw), sine = hn::Sin(tag, start.raw);
    const Float cos_step = hn::Cos(tag, step.raw), sin_step = hn::Sin(tag, step.raw);
    // Shadows are asked for elsewhere in each step: bands would be seen, and all else is best in its middle.
    const Float cos_aside = hn::Cos(tag, aside.raw), sin_aside = hn::Sin(tag, aside.raw);
    const Float light_y(source.light.position.y), g2(1.0f + air.g * air.g), twice_g(2.0f * air.g);
    Float sum(0.0f);
    for (unsigned i = 0; i < samples; ++i) {
        const Float r = h / max(cosine, Float(1e-6f)), off = r * sine, t = b + off, y = ray.y + ray.dy * t;
        const Vec3 p = foot + ray.d * off;
        Float value = web_ratio(source.light.web, p);
        if (!hn::AllFalse(tag, Float(0.0f) < value)) {
            if (source.distances != nullptr) {
                const Float own = cosine * cos_aside - sine * sin_aside, far = h / max(own, Float(1e-6f));
                const Vec3 q = foot + ray.d * (far * (sine * cos_aside + cosine * sin_aside));
                value = value * reaches(*source.distances, q, far);
            }
            // Towards the eye it turns by an angle whose cosine is -sine.
            const Float phase = inversesqrt(max(g2 + twice_g * sine, Float(1e-9f)));
            value = value * phase * phase * phase;
            if (air.per_height > 0.0f)
                value = value * exp(max(y - Float(air.floor_m), Float(0.0f)) * Float(-air.per_height)) *
                        air_passes(air, r, light_y, y) * air_passes(air, t, ray.y, y);
            else
                value = value * exp((r + t) * Float(-air.extinction_per_m));
            sum = sum + value;
        }
        const Float turned_cosine = cosine * cos_step - sine * sin_step;
        sine = sine * cos_step + cosine * sin_step;
        cosine = turned_cosine;
    }
    return sum * step / h;
}

void Airlight(const AirlightSource& source, const AirRays& rays, std::size_t first, std::size_t count, unsigned samples,
              float* out) {
    const Air& air = source.light.air;
    const float factor = air.extinction_per_m * air.albedo * (1.0f - air.g * air.g) /
                         (4.0f * std::numbers::pi_v<float>)*source.light.unit_m2;
    const unsigned few = std::max(samples / 2, 2u);
    for (std::size_t i = 0; i < count; i += hn::Lanes(Tag())) {
        const auto vec = [&](const std::vector<float>* values) {
            return Vec3(load(values[0].data() + first + i), load(values[1].data() + first + i),
                        load(values[2].data() + first + i));
        };
        const Vec3 from = vec(rays.from), along = vec(rays.along);
        const Bundle ray{turned(source.light.light_from_world, from - spread(source.light.position)),
                         turned(source.light.light_from_world, along), from.y, along.y,
                         load(rays.shift.data() + first + i)};
        Part whole{Float(0.0f), load(rays.far.data() + first + i)};
        if (source.light.beam_cos > 0.0f) whole = within_cone(ray.w, ray.d, source.light.beam_cos, whole);
        Float sum;
        if (hn::AllFalse(Tag(), whole.begin < whole.end)) {
            sum = Float(0.0f);
        } else if (source.core_cos > 0.0f && source.core_cos > source.light.beam_cos) {
            Part core = within_cone(ray.w, ray.d, source.core_cos, whole);
            core = {min(core.begin, whole.end), min(core.end, whole.end)};
            if (hn::AllFalse(Tag(), core.begin < core.end))
                sum = scattered(source, ray, whole, samples);
            else
                sum = scattered(source, ray, {whole.begin, core.begin}, few) + scattered(source, ray, core, samples) +
                      scattered(source, ray, {core.end, whole.end}, few);
        } else {
            sum = scattered(source, ray, whole, samples);
        }
        store(sum * Float(factor), out + i);
    }
}

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

HWY_EXPORT(Airlight);
HWY_EXPORT(PassesRow);
HWY_EXPORT(BetweenRow);
HWY_EXPORT(PackRow);

void trace_distances(const DirectLight& light, const trace::Geometry& geometry, int side, DistanceMap& map,
                     Pool& pool) {
    map.side = side;
    map.spread = 1.0f - std::max(-1.0f, light.beam_cos);
    map.metres.resize(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
    const glm::mat3 world_from_light = glm::transpose(light.light_from_world);
    const float start = geometry.step_off(light.position), margin = 1.0f + 4.0f / static_cast<float>(side);
    pool.run(side, [&](int row) {
        trace::RayPacket rays;
        trace::HitPacket hits;
        for (int column = 0; column < side; column += trace::kPacket) {
            unsigned active = 0;
            const int count = std::min(trace::kPacket, side - column);
            for (int i = 0; i < trace::kPacket; ++i) {
                const glm::vec2 p =
                    (glm::vec2(column + std::min(i, count - 1), row) + 0.5f) * (2.0f / static_cast<float>(side)) - 1.0f;
                const float out = glm::length(p), radius2 = std::min(out * out, 1.0f);
                // Down to the pole opposite, which is the whole rim.
                const float cosine = 1.0f - radius2 * map.spread,
                            sine = std::sqrt(std::max(0.0f, 1.0f - cosine * cosine));
                const glm::vec2 around = out > 0.0f ? p / out : glm::vec2(0.0f);
                const glm::vec3 direction = world_from_light * glm::vec3(around * sine, -cosine);
                rays.set(i, light.position + direction * start, direction);
                if (i < count && out < margin) active |= 1u << i;
            }
            const unsigned met = geometry.closest(rays, active, hits);
            for (int i = 0; i < count; ++i)
                map.metres[static_cast<std::size_t>(row * side + column + i)] =
                    (met >> i & 1u) != 0 ? hits.distance[i] + start : std::numeric_limits<float>::max();
        }
    });
}

void AirRays::resize(std::size_t count) {
    const std::size_t padded = (count + kSimdWidth - 1) / kSimdWidth * kSimdWidth;
    for (auto* arrays : {from, along})
        for (int k = 0; k < 3; ++k) arrays[k].assign(padded, k == 1 ? 1.0f : 0.0f);
    far.assign(padded, 0.0f);
    shift.assign(padded, 0.5f);
}

void AirRays::set(std::size_t i, const glm::vec3& start, const glm::vec3& direction, float far_m, float shift_ratio) {
    for (int k = 0; k < 3; ++k) from[k][i] = start[k], along[k][i] = direction[k];
    far[i] = far_m, shift[i] = shift_ratio;
}

void airlight(const AirlightSource& source, const AirRays& rays, std::size_t first, std::size_t count, unsigned samples,
              float* out) {
    HWY_DYNAMIC_DISPATCH(Airlight)(source, rays, first, count, samples, out);
}

void look_into_air(const GBuffer& s, int step, float far_m, AirView& view, Pool& pool) {
    view.step = step;
    view.width = (s.width + step - 1) / step, view.height = (s.height + step - 1) / step;
    view.rays.resize(view.size());
    const int offset = step / 2;
    pool.run(view.height, [&](int row) {
        // Sixteen places in a step, neighbours far apart (Bayer 1973).
        constexpr float kShifts[4][4] = {{0, 8, 2, 10}, {12, 4, 14, 6}, {3, 11, 1, 9}, {15, 7, 13, 5}};
        for (int column = 0; column < view.width; ++column) {
            const int x = std::min(column * step + offset, s.width - 1),
                      y = std::min(row * step + offset, s.height - 1);
            const glm::vec3 ray =
                s.rays.corner + static_cast<float>(x) * s.rays.right + static_cast<float>(y) * s.rays.up;
            const float length = glm::length(ray),
                        depth = s.depth[static_cast<std::size_t>(y) * s.row_length + static_cast<std::size_t>(x)];
            view.rays.set(static_cast<std::size_t>(row * view.width + column), s.rays.eye, ray / length,
                          depth > 0.0f ? length * s.rays.near_m / depth : far_m,
                          (kShifts[row & 3][column & 3] + 0.5f) / 16.0f);
        }
    });
}

void show_air(const GBuffer& s, const Air& air, const AirView& view, const Planes& planes,
              const std::array<std::uint64_t, 2>& passes_of, AirPicture& picture, Pool& pool) {
    constexpr float kGreatest = 1000.0f;  // of the half floats: they hold the rest to 2^-24 of it
    float most[3] = {};
    pool.run(3, [&](int k) {
        for (const float value : planes[static_cast<std::size_t>(k)]) most[k] = std::max(most[k], value);
    });
    const float greatest = std::max({most[0], most[1], most[2]});
    picture.unit = std::isfinite(greatest) && greatest > 0.0f ? greatest / kGreatest : 1.0f;
    const bool keeps = picture.halves.size() == 4 * s.depth.size() && picture.passes_of == passes_of;
    picture.halves.resize(4 * s.depth.size());
    picture.passes_of = passes_of;
    // The points of the view with a border, rgb and 1 / distance.
    const bool between = view.step > 1;
    const std::size_t stride = static_cast<std::size_t>(view.width) + 2 + kSimdWidth;
    static thread_local std::vector<float> kept;
    kept.resize(between ? 4 * stride * static_cast<std::size_t>(view.height) : 0);
    float* const points = kept.data();  // this thread's, in jobs too
    const auto row_of = [&](int row, std::size_t k) {
        return points + (4 * static_cast<std::size_t>(row) + k) * stride;
    };
    pool.run(between ? view.height : 0, [&](int row) {
        const auto y = static_cast<std::size_t>(std::min(row * view.step + view.step / 2, s.height - 1));
        const std::size_t first = static_cast<std::size_t>(row) * static_cast<std::size_t>(view.width);
        for (std::size_t k = 0; k < 4; ++k) {
            float* const to = row_of(row, k);
            for (int column = 0; column < view.width; ++column) {
                const auto x = static_cast<std::size_t>(std::min(column * view.step + view.step / 2, s.width - 1)),
                           at = static_cast<std::size_t>(column);
                to[at + 1] = k < 3 ? planes[k][first + at] : s.depth[y * s.row_length + x] / s.rays.near_m;
            }
            to[0] = to[1];
            std::fill(to + view.width + 1, to + stride, to[view.width]);
        }
    });
    pool.run(s.height, [&](int y) {
        static thread_local std::vector<float> row;
        row.resize(4 * s.row_length);
        float* const out[4] = {row.data(), row.data() + s.row_length, row.data() + 2 * s.row_length,
                               row.data() + 3 * s.row_length};
        if (between) {
            const float place =
                std::clamp((static_cast<float>(y) - 2.0f) / kStep, 0.0f, static_cast<float>(view.height - 1));
            const int below = static_cast<int>(place), above = std::min(below + 1, view.height - 1);
            PointRows around;
            for (std::size_t k = 0; k < 4; ++k) around.below[k] = row_of(below, k), around.above[k] = row_of(above, k);
            around.up = place - static_cast<float>(below);
            HWY_DYNAMIC_DISPATCH(BetweenRow)
            (s.depth.data() + static_cast<std::size_t>(y) * s.row_length, s.rays.near_m, around,
             static_cast<std::size_t>(view.width) * kStep, out);
        } else {
            for (std::size_t k = 0; k < 3; ++k)
                std::copy_n(planes[k].begin() + static_cast<std::ptrdiff_t>(y) * view.width, view.width, out[k]);
        }
        if (!keeps) HWY_DYNAMIC_DISPATCH(PassesRow)(s, air, y, out[3]);
        HWY_DYNAMIC_DISPATCH(PackRow)
        (out, 1.0f / picture.unit, s.row_length, keeps,
         picture.halves.data() + 4 * static_cast<std::size_t>(y) * s.row_length);
    });
}

}  // namespace gonio::lighting
#endif
