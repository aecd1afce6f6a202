#include "server/lighting/glow.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/packing.hpp>
#include <numbers>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/lighting/glow.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

// After the two above: once for each instruction set.
#include <hwy/contrib/math/math-inl.h>

HWY_BEFORE_NAMESPACE();
namespace gonio::lighting {
namespace HWY_NAMESPACE {

#include "server/lighting/simd.h"
#include "server/lighting/simd_air.h"

// What a probe's links bring, rgb, weighted by the phase function. along: from the eye to the probe, unit. emission: of
// the links; null: none.
void GlowAt(const Probes& probes, const std::uint16_t* ids, const glm::vec3* emission, const glm::vec4* sent,
            std::size_t sent_count, const glm::vec3& along, float g, float* rgb) {
    const Tag tag;
    const IntTag ints;
    const hn::Rebind<std::uint16_t, Tag> words;
    const Vec3 forward = spread(along);
    const auto end = hn::Set(ints, static_cast<std::int32_t>(sent_count));
    Float sum[3], all(0.0f);
    for (std::size_t i = 0; i < kProbeLinks; i += hn::Lanes(tag)) {
        const Vec3 link(load(probes.directions[0].data() + i), load(probes.directions[1].data() + i),
                        load(probes.directions[2].data() + i));
        // Henyey and Greenstein's, up to a factor.
        const Float d = inversesqrt(max(Float(1.0f + g * g) - Float(2.0f * g) * dot(forward, link), Float(1e-9f))),
                    phase = d * d * d;
        all = all + phase;
        const auto id = hn::PromoteTo(ints, hn::LoadU(words, ids + i)),
                   first = hn::ShiftLeft<2>(hn::Min(id, hn::Sub(end, hn::Set(ints, 1))));
        const Float weight =
            mix(Float(0.0f), phase * Float(1.0f / std::numbers::pi_v<float>), hn::RebindMask(tag, hn::Lt(id, end)));
        for (int k = 0; k < 3; ++k) sum[k] = sum[k] + weight * Float(hn::GatherIndex(tag, &sent->x + k, first));
        if (emission == nullptr) continue;
        Raw own[3];
        hn::LoadInterleaved3(tag, &emission[i].x, own[0], own[1], own[2]);
        for (int k = 0; k < 3; ++k) sum[k] = sum[k] + phase * Float(own[k]);
    }
    const float per_all = 1.0f / hn::GetLane(hn::SumOfLanes(tag, all.raw));
    for (int k = 0; k < 3; ++k) rgb[k] = per_all * hn::GetLane(hn::SumOfLanes(tag, sum[k].raw));
}

// What words of RGB9_E5 hold (EXT_texture_shared_exponent).
HWY_INLINE Vec3 unpack_rgb9e5(hn::Vec<IntTag> word) {
    constexpr int kBias = 15, kMantissa = 9, kFloatBias = 127, kFloatMantissa = 23;
    const IntTag ints;
    const Tag tag;
    const auto bits = hn::Set(ints, (1 << kMantissa) - 1);
    const auto exponent = hn::And(hn::ShiftRight<3 * kMantissa>(word), hn::Set(ints, 31));
    const Float scale(hn::BitCast(
        tag, hn::ShiftLeft<kFloatMantissa>(hn::Add(exponent, hn::Set(ints, kFloatBias - kBias - kMantissa)))));
    return Vec3(hn::ConvertTo(tag, hn::And(word, bits)),
                hn::ConvertTo(tag, hn::And(hn::ShiftRight<kMantissa>(word), bits)),
                hn::ConvertTo(tag, hn::And(hn::ShiftRight<2 * kMantissa>(word), bits))) *
           scale;
}

// What rays first … first + kSimdWidth − 1 collect, at kSteps places where equal shares of them are scattered. glow:
// a word of RGB9_E5 a probe; unit: its.
void GlowAlong(const Probes& probes, const std::uint32_t* glow, float unit, const Air& air, const AirRays& rays,
               std::size_t first, float* const* out) {
    constexpr int kSteps = 4;
    const Tag tag;
    const IntTag ints;
    for (std::size_t i = 0; i < kSimdWidth; i += hn::Lanes(tag)) {
        const auto vec = [&](const std::vector<float>* values) {
            return Vec3(load(values[0].data() + first + i), load(values[1].data() + first + i),
                        load(values[2].data() + first + i));
        };
        const Vec3 from = vec(rays.from), along = vec(rays.along);
        // Outside of the probes' box there is no glow.
        Float near(0.0f), far = load(rays.far.data() + first + i);
        const Float starts[3] = {from.x, from.y, from.z}, ways[3] = {along.x, along.y, along.z};
        for (int k = 0; k < 3; ++k) {
            const float half = 0.5f / probes.per_step[k], low = probes.least[k] - half,
                        high = low + static_cast<float>(probes.count[k]) / probes.per_step[k];
            const Float way = mix(ways[k], Float(1e-6f), abs(ways[k]) < Float(1e-6f)),
                        a = (Float(low) - starts[k]) / way, b = (Float(high) - starts[k]) / way;
            near = max(near, min(a, b)), far = min(far, max(a, b));
        }
        far = max(far, near);
        Float sum[3], passed = air_passes(air, near, from.y, from.y + along.y * near);
        for (int step = 0; step < kSteps; ++step) {
            const Float way = far - near, end = near + way * Float(static_cast<float>(step + 1) / kSteps),
                        t = near + way * Float((static_cast<float>(step) + 0.5f) / kSteps);
            const Float left = air_passes(air, end, from.y, from.y + along.y * end),
                        scattered = max(passed - left, Float(0.0f));
            passed = left;
            // The probes around it.
            Float place[3], share[3];
            hn::Vec<IntTag> cell[3];
            const Vec3 p = from + along * t;
            const Float at[3] = {p.x, p.y, p.z};
            for (int k = 0; k < 3; ++k) {
                const float last = static_cast<float>(probes.count[k] - 1);
                place[k] =
                    min(max((at[k] - Float(probes.least[k])) * Float(probes.per_step[k]), Float(0.0f)), Float(last));
                cell[k] = hn::Min(hn::ConvertTo(ints, place[k].raw), hn::Set(ints, std::max(probes.count[k] - 2, 0)));
                share[k] = place[k] - Float(hn::ConvertTo(tag, cell[k]));
            }
            Float value[3];
            for (int corner = 0; corner < 8; ++corner) {
                Float weight(1.0f);
                hn::Vec<IntTag> index = hn::Zero(ints);
                for (int k = 2; k >= 0; --k) {
                    const bool upper = (corner >> k & 1) != 0;
                    weight = weight * (upper ? share[k] : Float(1.0f) - share[k]);
                    const auto row = hn::Min(upper ? hn::Add(cell[k], hn::Set(ints, 1)) : cell[k],
                                             hn::Set(ints, probes.count[k] - 1));
                    index = hn::Add(hn::Mul(index, hn::Set(ints, probes.count[k])), row);
                }
                const Vec3 rgb =
                    unpack_rgb9e5(hn::GatherIndex(ints, reinterpret_cast<const std::int32_t*>(glow), index));
                value[0] = value[0] + weight * rgb.x;
                value[1] = value[1] + weight * rgb.y;
                value[2] = value[2] + weight * rgb.z;
            }
            for (int k = 0; k < 3; ++k) sum[k] = sum[k] + value[k] * scattered;
        }
        for (int k = 0; k < 3; ++k)
            store(load(out[k] + first + i) + sum[k] * Float(air.albedo * unit), out[k] + first + i);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace gonio::lighting
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gonio::lighting {

HWY_EXPORT(GlowAt);
HWY_EXPORT(GlowAlong);

namespace {

// Result: where a probe is, local, m.
glm::vec3 place_of(const Probes& probes, std::size_t i) {
    const auto nx = static_cast<std::size_t>(probes.count.x), ny = static_cast<std::size_t>(probes.count.y);
    return probes.least + glm::vec3(i % nx, i / nx % ny, i / (nx * ny)) / probes.per_step;
}

}  // namespace

AirBox air_box(const trace::Geometry& geometry, const glm::vec3& eye) {
    const Bounds& bounds = geometry.asset().bounds;
    AirBox box{geometry.local(bounds.min), geometry.local(bounds.max)};
    const auto outside = [&](float by_m) {
        const float radii = std::ceil(std::max(by_m, 0.0f) / geometry.extent());
        return std::min(radii, static_cast<float>(kMostOutside)) * geometry.extent();
    };
    for (int k = 0; k < 3; ++k) {
        const float below = outside(box.low[k] - eye[k]), above = outside(eye[k] - box.high[k]);
        box.low[k] -= below, box.high[k] += above;
    }
    return box;
}

Probes make_probes(const transport::Transport::Surface& surface, const AirBox& box, Pool& pool) {
    Probes probes;
    const auto& [low, high] = box;
    const glm::vec3 extent = glm::max(high - low, glm::vec3(1e-3f));
    // As even as their number allows.
    float step = std::cbrt(extent.x * extent.y * extent.z / static_cast<float>(kMostProbes));
    const auto count_for = [&](float apart) { return glm::clamp(glm::ivec3(extent / apart), 2, kMostProbes / 4); };
    while (count_for(step).x * count_for(step).y * count_for(step).z > kMostProbes) step *= 1.05f;
    probes.count = count_for(step);
    // Half a step inside the box: on a wall they would see no more than half of it.
    const glm::vec3 apart = extent / glm::vec3(probes.count);
    probes.least = low + 0.5f * apart;
    probes.per_step = 1.0f / apart;
    for (int k = 0; k < kProbeLinks; ++k) {  // Fibonacci's spiral
        const float y = 1.0f - (static_cast<float>(k) + 0.5f) * 2.0f / kProbeLinks, out = std::sqrt(1.0f - y * y),
                    turn = std::numbers::pi_v<float> * (3.0f - std::sqrt(5.0f)) * static_cast<float>(k);
        probes.directions[0].push_back(out * std::cos(turn));
        probes.directions[1].push_back(y);
        probes.directions[2].push_back(out * std::sin(turn));
    }
    probes.ids.resize(probes.size() * kProbeLinks);
    if (!surface.emitters.emitters.empty()) probes.emission.resize(probes.ids.size(), glm::vec3(0.0f));
    pool.run_chunks(probes.size(), 16, [&](std::size_t first, std::size_t size) {
        trace::HitPacket hits;
        for (std::size_t i = first; i < first + size; ++i) {
            const glm::vec3 p = place_of(probes, i);
            for (int k = 0; k < kProbeLinks; k += trace::kPacket) {
                transport::Fan fan;
                for (int j = 0; j < trace::kPacket; ++j) {
                    const auto link = static_cast<std::size_t>(k + j);
                    fan.rays.set(j, p,
                                 {probes.directions[0][link], probes.directions[1][link], probes.directions[2][link]});
                }
                fan.active = (1u << trace::kPacket) - 1u;
                transport::follow(fan, *surface.geometry, surface.surfels, *surface.cells, hits,
                                  probes.ids.data() + i * kProbeLinks + static_cast<std::size_t>(k));
                if (probes.emission.empty()) continue;
                trace::SurfaceHit seen[trace::kPacket];
                const unsigned met = surface.geometry->closest(fan.rays, fan.active, seen);
                for (int j = 0; j < trace::kPacket; ++j)
                    if ((met >> j & 1u) != 0)
                        probes.emission[i * kProbeLinks + static_cast<std::size_t>(k + j)] = seen[j].emission;
            }
        }
    });
    return probes;
}

void glow_of(const Probes& probes, std::span<const glm::vec4> sent, bool emission, const glm::vec3& eye, float g,
             Glow& glow, Pool& pool) {
    glow.assign(probes.size(), glm::vec3(0.0f));
    if (sent.empty()) return;
    const bool emits = emission && !probes.emission.empty();
    pool.run_chunks(probes.size(), 64, [&](std::size_t first, std::size_t size) {
        for (std::size_t i = first; i < first + size; ++i) {
            const glm::vec3 p = place_of(probes, i), along = glm::normalize(p - eye + glm::vec3(1e-6f));
            const glm::vec3* const own = emits ? probes.emission.data() + i * kProbeLinks : nullptr;
            HWY_DYNAMIC_DISPATCH(GlowAt)
            (probes, probes.ids.data() + i * kProbeLinks, own, sent.data(), sent.size(), along, g, &glow[i].x);
        }
    });
}

std::vector<std::uint8_t> seen_probes(const Probes& probes, const trace::Geometry& geometry, const glm::vec3& eye,
                                      Pool& pool) {
    std::vector<std::uint8_t> seen(probes.size());
    pool.run_chunks(probes.size(), 64, [&](std::size_t first, std::size_t size) {
        for (std::size_t i = first; i < first + size; ++i) {
            const glm::vec3 way = place_of(probes, i) - eye;
            const float length_m = glm::length(way);
            trace::SurfaceHit hit;
            seen[i] =
                length_m == 0.0f || !geometry.closest(eye, way / length_m, 0.0f, true, hit) || hit.distance >= length_m;
        }
    });
    return seen;
}

void hide_unseen(const Probes& probes, std::span<const std::uint8_t> seen, Glow& glow) {
    const glm::ivec3 count = probes.count;
    const auto at = [&](const glm::ivec3& p) {
        return static_cast<std::size_t>((p.z * count.y + p.y) * count.x + p.x);
    };
    const Glow own = glow;
    glm::ivec3 p;
    for (p.z = 0; p.z < count.z; ++p.z)
        for (p.y = 0; p.y < count.y; ++p.y)
            for (p.x = 0; p.x < count.x; ++p.x) {
                if (seen[at(p)] != 0) continue;
                glm::vec3 sum(0.0f);
                float weights = 0.0f;
                for (int k = 0; k < 27; ++k) {
                    const glm::ivec3 off = glm::ivec3(k % 3, k / 3 % 3, k / 9) - 1, q = p + off;
                    if (glm::any(glm::lessThan(q, glm::ivec3(0))) || glm::any(glm::greaterThanEqual(q, count)) ||
                        seen[at(q)] == 0)
                        continue;
                    const float weight = 1.0f / static_cast<float>(glm::dot(glm::vec3(off), glm::vec3(off)));
                    sum += weight * own[at(q)], weights += weight;
                }
                if (weights > 0.0f) glow[at(p)] = sum / weights;
            }
}

void add_glow(const Probes& probes, const PackedGlow& glow, const Air& air, const AirRays& rays, std::size_t first,
              std::size_t count, float* const* rgb) {
    for (std::size_t i = first; i < first + count; i += kSimdWidth)
        HWY_DYNAMIC_DISPATCH(GlowAlong)(probes, glow.words.data(), glow.unit, air, rays, i, rgb);
}

PackedGlow pack_glow(const Glow& glow) {
    constexpr float kGreatest = 32768.0f;  // that GLM packs; the least but 0 is 2^-24
    float most = 0.0f;
    for (const glm::vec3& rgb : glow) most = std::max({most, rgb.x, rgb.y, rgb.z});
    PackedGlow result;
    result.unit = std::isfinite(most) && most > 0.0f ? most / kGreatest : 1.0f;
    for (const glm::vec3& rgb : glow) result.words.push_back(glm::packF3x9_E1x5(rgb / result.unit));
    return result;
}

}  // namespace gonio::lighting
#endif
