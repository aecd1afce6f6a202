#include "server/lighting/glow.h"

#include <algorithm>
#include <cmath>
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

// What rays first … first + kSimdWidth − 1 collect, at kSteps places where equal shares of them are scattered.
void GlowAlong(const Probes& probes, const float* glow, const Air& air, const AirRays& rays, std::size_t first,
               float* const* out) {
    constexpr int kSteps = 4, kFloats = 3;
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
            Float value[kFloats];
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
                index = hn::Mul(index, hn::Set(ints, kFloats));
                for (int k = 0; k < kFloats; ++k)
                    value[k] = value[k] + weight * Float(hn::GatherIndex(tag, glow + k, index));
            }
            for (int k = 0; k < 3; ++k) sum[k] = sum[k] + value[k] * scattered;
        }
        for (int k = 0; k < 3; ++k) store(sum[k] * Float(air.albedo), out[k] + i);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace gonio::lighting
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gonio::lighting {

HWY_EXPORT(GlowAlong);

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
        probes.directions.emplace_back(out * std::cos(turn), y, out * std::sin(turn));
    }
    probes.ids.resize(probes.size() * kProbeLinks);
    if (!surface.emitters.emitters.empty()) probes.emission.resize(probes.ids.size(), glm::vec3(0.0f));
    pool.run_chunks(probes.size(), 16, [&](std::size_t first, std::size_t size) {
        trace::HitPacket hits;
        for (std::size_t i = first; i < first + size; ++i) {
            const auto nx = static_cast<std::size_t>(probes.count.x), ny = static_cast<std::size_t>(probes.count.y);
            const glm::vec3 p = probes.least + apart * glm::vec3(i % nx, i / nx % ny, i / (nx * ny));
            for (int k = 0; k < kProbeLinks; k += trace::kPacket) {
                transport::Fan fan;
                for (int j = 0; j < trace::kPacket; ++j)
                    fan.rays.set(j, p, probes.directions[static_cast<std::size_t>(k + j)]);
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
             std::vector<glm::vec3>& glow, Pool& pool) {
    glow.assign(probes.size(), glm::vec3(0.0f));
    const auto nx = static_cast<std::size_t>(probes.count.x), ny = static_cast<std::size_t>(probes.count.y);
    pool.run_chunks(probes.size(), 64, [&](std::size_t first, std::size_t size) {
        for (std::size_t i = first; i < first + size; ++i) {
            const glm::vec3 p = probes.least + glm::vec3(i % nx, i / nx % ny, i / (nx * ny)) / probes.per_step,
                            along = glm::normalize(p - eye + glm::vec3(1e-6f));
            float all = 0.0f;  // of the phase function over the links' directions, which are few
            glm::vec3 sum(0.0f);
            for (std::size_t k = 0; k < kProbeLinks; ++k) {
                const auto phase = static_cast<float>(henyey_greenstein(
                    static_cast<double>(g), static_cast<double>(glm::dot(along, probes.directions[k]))));
                all += phase;
                const std::size_t link = i * kProbeLinks + k, id = probes.ids[link];
                if (id < sent.size()) sum += phase / std::numbers::pi_v<float> * glm::vec3(sent[id]);
                if (emission && !probes.emission.empty()) sum += phase * probes.emission[link];
            }
            glow[i] = sum / all;
        }
    });
}

void add_glow(const Probes& probes, std::span<const glm::vec3> glow, const Air& air, const AirView& view, float unit,
              Planes& planes, Pool& pool) {
    if (glow.empty() || glow.size() != probes.size()) return;
    pool.run_chunks(view.rays.size() / kSimdWidth, 64, [&](std::size_t first, std::size_t size) {
        for (std::size_t i = first * kSimdWidth; i < (first + size) * kSimdWidth; i += kSimdWidth) {
            alignas(64) float rgb[3][kSimdWidth];
            float* const out[3] = {rgb[0], rgb[1], rgb[2]};
            HWY_DYNAMIC_DISPATCH(GlowAlong)(probes, &glow[0][0], air, view.rays, i, out);
            for (std::size_t k = 0; k < 3; ++k)
                for (std::size_t j = 0; j < kSimdWidth; ++j) planes[k][i + j] += unit * rgb[k][j];
        }
    });
}

}  // namespace gonio::lighting
#endif
