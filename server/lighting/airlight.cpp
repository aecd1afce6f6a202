#include "server/lighting/airlight.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "shaders/shared/layouts.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/lighting/airlight.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

// After the two above: once for each instruction set.
#include <hwy/contrib/math/math-inl.h>

HWY_BEFORE_NAMESPACE();
namespace gonio::lighting {
namespace HWY_NAMESPACE {

#include "server/lighting/simd.h"
#include "server/lighting/simd_air.h"
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

// 1 where a map's light reaches the distance r in the direction of p; between texels as many of the four as are further
// away.
HWY_INLINE Float reaches(const DistanceMap& map, const Vec3& p, Float r) {
    const Tag tag;
    const IntTag ints;
    const Float per_r = inversesqrt(max(dot(p, p), Float(1e-12f))), half(0.5f * static_cast<float>(map.side)),
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
    Float y, dy, shift, pixel_rad;
};

// Of the nth place from an end, of so many in the middles of even steps: exact for cubics, and for parabolas where they
// are fewer than six (open Newton-Cotes rules with corrections at the ends, Press et al. 2007, §4.1).
HWY_INLINE float end_weight(unsigned n, unsigned samples) {
    if (samples == 3) return n == 0 ? 9.0f / 8.0f : 3.0f / 4.0f;
    if (samples < 6) return 1.0f;
    constexpr float kWeights[] = {13.0f / 12.0f, 7.0f / 8.0f, 25.0f / 24.0f};
    return n < 3 ? kWeights[n] : 1.0f;
}

// What `samples` places in a part of the rays scatter to their start.
HWY_INLINE Float scattered(const AirlightSource& source, const Bundle& ray, const Part& part, unsigned samples) {
    // The mean of 1 / h over a square of side 1 about the luminaire is 4 ln(1 + √2), that of h = 0.2837.
    constexpr float kPixel = 0.2837f;
    const Tag tag;
    const Air& air = source.light.air;
    Air beyond = air;
    beyond.extinction_per_m *= source.beyond_ratio;
    const Float b = -dot(ray.w, ray.d);
    const Vec3 foot = ray.w + ray.d * b;
    const Float blur = max(b, Float(0.0f)) * ray.pixel_rad * Float(kPixel);
    const Float h = max(sqrt(dot(foot, foot) + blur * blur), Float(source.least_m));
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
                        air_passes(air, r, light_y, y) * air_passes(beyond, t, ray.y, y);
            else
                value = value * exp(r * Float(-air.extinction_per_m) - t * Float(beyond.extinction_per_m));
            sum = sum + value * Float(end_weight(std::min(i, samples - 1 - i), samples));
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
                         turned(source.light.light_from_world, along),
                         from.y,
                         along.y,
                         load(rays.shift.data() + first + i),
                         load(rays.pixel_rad.data() + first + i)};
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
            sum = scattered(source, ray, whole, samples + few);
        }
        store(sum * Float(factor), out + i);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace gonio::lighting
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gonio::lighting {

HWY_EXPORT(Airlight);

namespace {

// Where a texel's ray ends, seen from the luminaire: the point, m, and its surface as the plane plane · p = 1.
struct End {
    glm::vec3 point{0.0f}, plane{0.0f};
};

// How far light goes in all directions between a texel and those around it that end on the same plane. Along a wall
// that is close to the luminaire distances change fast, and light must not come out behind the wall between two of
// them.
float least_around(const std::vector<End>& ends, int side, int row, int column) {
    constexpr float kSame = 0.02f, kClose_m = 0.05f;
    const auto at = [&](int y, int x) -> const End& { return ends[static_cast<std::size_t>(y * side + x)]; };
    const End& own = at(row, column);
    float least2 = glm::dot(own.point, own.point);
    if (glm::dot(own.plane, own.plane) * (kClose_m * kClose_m) < 1.0f) return std::sqrt(least2);  // it is farther away
    for (int y = std::max(row - 1, 0); y <= std::min(row + 1, side - 1); ++y)
        for (int x = std::max(column - 1, 0); x <= std::min(column + 1, side - 1); ++x)
            if (std::abs(glm::dot(own.plane, at(y, x).point) - 1.0f) < kSame)
                least2 = std::min(least2, glm::dot(at(y, x).point, at(y, x).point));
    return std::sqrt(least2);
}

}  // namespace

void trace_distances(const DirectLight& light, const trace::Geometry& geometry, int side, DistanceMap& map,
                     Pool& pool) {
    map.side = side;
    map.spread = 1.0f - std::max(-1.0f, light.beam_cos);
    const std::size_t texels = static_cast<std::size_t>(side) * static_cast<std::size_t>(side);
    map.metres.assign(texels, std::numeric_limits<float>::max());
    std::vector<End> ends(texels);
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
            for (int i = 0; i < count; ++i) {
                if ((met >> i & 1u) == 0) continue;
                End& end = ends[static_cast<std::size_t>(row * side + column + i)];
                end.point = (hits.distance[i] + start) * rays.along(i);
                end.plane = hits.normal(i) / glm::dot(hits.normal(i), end.point);
            }
        }
    });
    pool.run(side, [&](int row) {
        for (int column = 0; column < side; ++column) {
            const std::size_t at = static_cast<std::size_t>(row * side + column);
            if (ends[at].plane != glm::vec3(0.0f)) map.metres[at] = least_around(ends, side, row, column);
        }
    });
}

void AirRays::resize(std::size_t count) {
    const std::size_t padded = (count + kSimdWidth - 1) / kSimdWidth * kSimdWidth;
    for (auto* arrays : {from, along})
        for (int k = 0; k < 3; ++k) arrays[k].assign(padded, k == 1 ? 1.0f : 0.0f);
    far.assign(padded, 0.0f);
    shift.assign(padded, 0.5f);
    pixel_rad.assign(padded, 0.0f);
}

void AirRays::set(std::size_t i, const glm::vec3& start, const glm::vec3& direction, float far_m, float shift_ratio,
                  float wide_rad) {
    for (int k = 0; k < 3; ++k) from[k][i] = start[k], along[k][i] = direction[k];
    far[i] = far_m, shift[i] = shift_ratio, pixel_rad[i] = wide_rad;
}

void airlight(const AirlightSource& source, const AirRays& rays, std::size_t first, std::size_t count, unsigned samples,
              float* out) {
    HWY_DYNAMIC_DISPATCH(Airlight)(source, rays, first, count, samples, out);
}

}  // namespace gonio::lighting
#endif
