#include "server/bake/gather.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "server/trace/sampler.h"

namespace gonio::bake {
namespace {

constexpr int kGatherTile = 32;  // texels of one job

}  // namespace

// What leaves, what scatters, what arrives: one loop over texels, halves and packets.
bool gather(const Atlas& atlas, const trace::Geometry& geometry, const GatherSettings& settings,
            std::span<const glm::vec3> leaving, std::span<const GatheredAir> air, std::size_t sources,
            std::span<glm::vec3> irradiance, std::span<float> error, Work& work) {
    const int half_directions = std::max(1, settings.directions / 32) * trace::kPacket;
    const double beyond_m = 4.0 * static_cast<double>(geometry.extent());  // how far air reaches where nothing is
    return work.tiles(static_cast<int>(atlas.texels.size()), kGatherTile, [&](int first, int end) {
        std::vector<glm::vec3> sum(2 * sources);
        trace::RayPacket rays;
        trace::HitPacket hits;
        std::uint64_t count = 0;
        for (int i = first; i < end; ++i) {
            const auto at = static_cast<std::size_t>(i);
            const Texel& texel = atlas.texels[at];
            std::fill(sum.begin(), sum.end(), glm::vec3(0.0f));
            const glm::vec3 from = texel.position + texel.geometric * geometry.step_off(texel.position);
            for (int half = 0; half < 2 && texel.valid; ++half) {
                const std::uint32_t seed =
                    trace::mix_bits(trace::mix_bits(settings.seed, static_cast<std::uint32_t>(texel.pixel)),
                                    static_cast<std::uint32_t>(half));
                glm::vec3* const to = &sum[static_cast<std::size_t>(half) * sources];
                for (int start = 0; start < half_directions; start += trace::kPacket) {
                    unsigned active = 0;
                    float shifts[trace::kPacket];
                    for (int k = 0; k < trace::kPacket; ++k) {
                        trace::Sample sample(seed, static_cast<std::uint32_t>(start + k));
                        const glm::vec3 along = trace::around(texel.normal, trace::cosine_hemisphere(sample.next()));
                        rays.set(k, from, along);
                        if (!air.empty()) shifts[k] = sample.next().x;
                        if (glm::dot(along, texel.geometric) > 0.0f) active |= 1u << k;
                    }
                    const unsigned met = geometry.closest(rays, active, hits);
                    count += trace::kPacket;
                    for (int k = 0; k < trace::kPacket; ++k) {
                        if ((active >> k & 1u) == 0) continue;
                        const bool hit = (met >> k & 1u) != 0;
                        if (!air.empty()) {
                            const glm::dvec3 origin(from), along(rays.along(k));
                            const double length = hit ? static_cast<double>(hits.distance[k]) : beyond_m;
                            for (std::size_t s = 0; s < sources; ++s) {
                                if (air[s].luminaire == nullptr) continue;
                                const double nit =
                                    scattered_in(geometry, *air[s].luminaire, *air[s].volume, settings.air, origin,
                                                 along, length, static_cast<double>(shifts[k]), count);
                                to[s] += glm::vec3(static_cast<float>(nit * std::numbers::pi));
                            }
                        }
                        if (!hit) continue;
                        const bool back = glm::dot(hits.normal(k), rays.along(k)) > 0.0f;
                        const int other =
                            atlas.texel_of(static_cast<int>(hits.instance[k]), static_cast<int>(hits.triangle[k]), back,
                                           hits.u[k], hits.v[k]);
                        if (other < 0) continue;
                        float passed = 1.0f;
                        if (settings.air.haze)
                            passed = static_cast<float>(transmittance(settings.air.haze, glm::dvec3(from),
                                                                      glm::dvec3(rays.at(k, hits.distance[k]))));
                        const glm::vec3* const sent = &leaving[static_cast<std::size_t>(other) * sources];
                        for (std::size_t s = 0; s < sources; ++s) to[s] += passed * sent[s];
                    }
                }
            }
            for (std::size_t s = 0; s < sources; ++s) {
                const glm::vec3 a = sum[s] / static_cast<float>(half_directions),
                                b = sum[sources + s] / static_cast<float>(half_directions);
                irradiance[at * sources + s] = 0.5f * (a + b);
                error[at * sources + s] = 0.5f * std::abs(trace::luminance(a) - trace::luminance(b));
            }
        }
        work.rays += count;
    });
}

}  // namespace gonio::bake
