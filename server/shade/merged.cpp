#include "server/shade/merged.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "server/trace/sampler.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/shade/merged.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace gonio::shade {
namespace HWY_NAMESPACE {

#include "server/shade/lanes.h"
#include "server/shade/web_lanes.h"

// What all luminaires do at kLanes surface points, if nothing stands between. per_m2: how many of the list's rays end
// there. brings: illuminance as luminance. chosen: a luminaire drawn in proportion to what it brings by random, a
// number of [0, 1) per point; -1 if none brings any.
void LookAtLights(std::span<const MergedLight> lights, const Points& points, const float* random, float* per_m2,
                  float* brings, int* chosen) {
    const Tag tag;
    const IntTag ints;
    for (std::size_t i = 0; i < kLanes; i += hn::Lanes(tag)) {
        const Vec3 p(load(points.x + i), load(points.y + i), load(points.z + i));
        const Vec3 n(load(points.nx + i), load(points.ny + i), load(points.nz + i));
        Float dense, total, left(load(random + i));
        auto choice = hn::Set(ints, -1);
        for (std::size_t k = 0; k < lights.size(); ++k) {
            const MergedLight& light = lights[k];
            const Vec3 to = p - spread(light.position);
            const Float d2 = max(dot(to, to), Float(1e-12f));
            const Float cosine = -dot(n, to) * inversesqrt(d2);
            const Mask faces = Float(0.0f) < cosine;
            if (hn::AllFalse(tag, faces)) continue;
            const Float ratio = hn::IfThenElseZero(faces, web_ratio(light.web, turned(light.light_from_world, to)).raw);
            const Float per_d2 = ratio / d2;
            // As of texel_area: grazing rays are bounded.
            dense = dense + per_d2 * max(cosine, Float(0.02f)) * Float(light.rays_per_sr);
            const Float own = per_d2 * max(cosine, Float(0.0f)) * Float(light.luminance);
            total = total + own;
            // One number decides all the way: what is left of it is uniform again after each decision.
            const Float share = own / max(total, Float(1e-30f));
            const Mask taken = left < share;
            choice = hn::IfThenElse(hn::RebindMask(ints, taken), hn::Set(ints, static_cast<int>(k)), choice);
            left =
                mix((left - share) / max(Float(1.0f) - share, Float(1e-6f)), left / max(share, Float(1e-30f)), taken);
        }
        store(dense, per_m2 + i);
        store(total, brings + i);
        hn::StoreU(choice, ints, chosen + i);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace gonio::shade
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gonio::shade {

HWY_EXPORT(LookAtLights);

namespace {

// The list is so many times as long as one luminaire's: its light comes from more places.
constexpr unsigned kLonger = 2;

// Result: how many rays of each subset every source gives: powers of two, `in_all` at most unless one each is more.
std::vector<unsigned> shares_of(std::span<const double> power, std::span<const unsigned> most, unsigned in_all) {
    std::vector<unsigned> shares(power.size(), 1);
    unsigned used = static_cast<unsigned>(power.size());
    for (;;) {
        std::size_t neediest = power.size();
        for (std::size_t i = 0; i < power.size(); ++i) {
            if (2 * shares[i] > most[i] || used + shares[i] > in_all) continue;
            if (neediest == power.size() || power[i] / shares[i] > power[neediest] / shares[neediest]) neediest = i;
        }
        if (neediest == power.size()) return shares;
        used += shares[neediest];
        shares[neediest] *= 2;
    }
}

}  // namespace

MergedList merge(std::span<const MergedSource> all, Pool& pool) {
    MergedList list;
    std::vector<const MergedSource*> sources;
    for (const MergedSource& source : all) {
        const float greatest = std::max({source.weight.x, source.weight.y, source.weight.z});
        if (!(greatest > 0.0f) || source.vpls.per_subset == 0 || sources.size() == kMostMerged) continue;
        sources.push_back(&source);
        list.reference = std::max(list.reference, greatest);
    }
    if (sources.empty()) return list;
    std::vector<double> power;
    std::vector<unsigned> most;
    for (const MergedSource* source : sources) {
        const Profile& profile = *source->rays.table->profile();
        power.push_back(static_cast<double>(trace::luminance(source->weight)) * profile.flux_lm / profile.max_cd);
        most.push_back(source->vpls.per_subset);
    }
    const unsigned per_subset = *std::max_element(most.begin(), most.end());
    const std::vector<unsigned> shares = shares_of(power, most, kLonger * per_subset);
    for (std::size_t i = 0; i < sources.size(); ++i) {
        const MergedSource& source = *sources[i];
        const Profile& profile = *source.rays.table->profile();
        const glm::vec3 weight = source.weight / list.reference;
        list.lights.push_back({glm::vec3(source.position), glm::mat3(glm::transpose(source.world_from_light)),
                               source.web, weight, trace::luminance(weight),
                               static_cast<float>(kSubsets * shares[i] * profile.max_cd / profile.flux_lm),
                               source.beam_cos});
    }

    // The order within a subset: whoever takes the first half, or a quarter, finds every luminaire's share in it.
    struct Turn {
        double when;
        std::size_t source;
        unsigned ray;
    };
    std::vector<Turn> turns;
    std::vector<std::size_t> firsts;  // by source: the first ray it gives
    for (std::size_t i = 0; i < sources.size(); ++i) {
        // Any aligned run of a power of two of the rays is stratified, and so are its sixteenths, one for each subset.
        // Luminaires take different runs: those of one profile would all err alike otherwise.
        const double phase = static_cast<double>(trace::unit_interval(trace::reverse_bits(static_cast<unsigned>(i))));
        firsts.push_back(static_cast<std::size_t>(phase * (most[i] / shares[i])) * shares[i] * kSubsets);
        for (unsigned ray = 0; ray < shares[i]; ++ray) turns.push_back({(ray + phase) / shares[i], i, ray});
    }
    std::stable_sort(turns.begin(), turns.end(), [](const Turn& a, const Turn& b) { return a.when < b.when; });

    // The gather takes whole packets of VPLs from every subset alike.
    list.vpls.per_subset = static_cast<unsigned>(turns.size());
    const std::size_t count = turns.size() * kSubsets, padded = (count + kLanes - 1) / kLanes * kLanes;
    list.vpls.vpls.resize(padded);
    std::vector<std::size_t> own(count);
    for (std::size_t subset = 0; subset < kSubsets; ++subset) {
        for (std::size_t t = 0; t < turns.size(); ++t) {
            const MergedSource& source = *sources[turns[t].source];
            Vpl vpl = source.vpls.vpls[firsts[turns[t].source] + subset * shares[turns[t].source] + turns[t].ray];
            vpl.position_area =
                glm::vec4(glm::vec3(source.position + glm::dvec3(glm::vec3(vpl.position_area))), vpl.position_area.w);
            const glm::vec3 scale =
                source.weight / list.reference *
                (static_cast<float>(source.vpls.per_subset) / static_cast<float>(shares[turns[t].source]));
            vpl.intensity *= glm::vec4(scale, 0.0f);
            list.vpls.vpls[subset * turns.size() + t] = vpl;
            own[subset * turns.size() + t] = turns[t].source;
        }
    }

    // What a VPL stands for among all luminaires' VPLs.
    std::vector<double> areas(padded / kLanes);
    std::vector<int> lit(padded / kLanes);
    pool.run(static_cast<int>(padded / kLanes), [&](int packet) {
        const std::size_t first = static_cast<std::size_t>(packet) * kLanes;
        alignas(64) float at[6][kLanes], random[kLanes] = {}, per_m2[kLanes], brings[kLanes];
        alignas(64) int chosen[kLanes];
        for (std::size_t i = 0; i < kLanes; ++i) {
            const Vpl& vpl = list.vpls.vpls[first + i];
            for (std::size_t k = 0; k < 3; ++k) {
                at[k][i] = vpl.position_area[static_cast<int>(k)];
                at[k + 3][i] = vpl.normal[static_cast<int>(k)];
            }
        }
        HWY_DYNAMIC_DISPATCH(LookAtLights)
        (list.lights, {at[0], at[1], at[2], at[3], at[4], at[5]}, random, per_m2, brings, chosen);
        for (std::size_t i = 0; i < kLanes && first + i < count; ++i) {
            Vpl& vpl = list.vpls.vpls[first + i];
            if (vpl.normal == glm::vec4(0.0f)) continue;
            if (per_m2[i] > 0.0f) {
                vpl.position_area.w = 1.0f / (std::numbers::pi_v<float> * per_m2[i]);
            } else {  // only its shading normal turns it away from its luminaire
                const std::size_t source = own[first + i];
                vpl.position_area.w *=
                    static_cast<float>(sources[source]->vpls.per_subset) / static_cast<float>(shares[source]);
            }
            areas[static_cast<std::size_t>(packet)] += static_cast<double>(vpl.position_area.w) * std::numbers::pi;
            ++lit[static_cast<std::size_t>(packet)];
        }
    });
    int lit_count = 0;
    for (std::size_t i = 0; i < areas.size(); ++i) list.vpls.mean_area_m2 += areas[i], lit_count += lit[i];
    if (lit_count > 0) list.vpls.mean_area_m2 /= lit_count;
    return list;
}

void add_merged_near_light(const LightView& view, const Points& points, unsigned active, const Directions& about_z,
                           float kappa, NearSums& sums) {
    constexpr float pi = std::numbers::pi_v<float>;
    const MergedList& list = *view.merged;
    const float far = near_reach(list.vpls, kappa);
    trace::RayPacket query;
    for (int i = 0; i < trace::kPacket; ++i) {
        const glm::vec3 p(points.x[i], points.y[i], points.z[i]), n(points.nx[i], points.ny[i], points.nz[i]);
        const glm::vec3 d = trace::around(n, {about_z.x[i], about_z.y[i], about_z.z[i]});
        const glm::vec3 from = p + 4.0f * view.geometry.step_off(p) * n;
        query.from_x[i] = from.x, query.from_y[i] = from.y, query.from_z[i] = from.z;
        query.along_x[i] = d.x, query.along_y[i] = d.y, query.along_z[i] = d.z;
        query.far[i] = far;
    }
    trace::SurfaceHit hits[trace::kPacket];
    const unsigned met = view.geometry.closest(query, active, hits);
    if (met == 0) return;

    static_assert(kLanes == trace::kPacket);
    alignas(64) float at[6][kLanes] = {}, choice[kLanes] = {}, per_m2[kLanes], brings[kLanes];
    alignas(64) int chosen[kLanes];
    for (int i = 0; i < trace::kPacket; ++i) {
        if ((met >> i & 1u) == 0) continue;
        for (int k = 0; k < 3; ++k) at[k][i] = hits[i].position[k], at[k + 3][i] = hits[i].normal[k];
        choice[i] = trace::unit_interval(trace::mix_bits(
            trace::mix_bits(std::bit_cast<std::uint32_t>(points.x[i]), std::bit_cast<std::uint32_t>(points.y[i])),
            std::bit_cast<std::uint32_t>(points.z[i]) ^ std::bit_cast<std::uint32_t>(about_z.x[i])));
    }
    HWY_DYNAMIC_DISPATCH(LookAtLights)
    (list.lights, {at[0], at[1], at[2], at[3], at[4], at[5]}, choice, per_m2, brings, chosen);
    glm::vec3 found[trace::kPacket];
    unsigned lit = 0;
    for (int i = 0; i < trace::kPacket; ++i) {
        if ((met >> i & 1u) == 0 || chosen[i] < 0 || !(per_m2[i] > 0.0f)) continue;
        const trace::SurfaceHit& y = hits[i];
        const MergedLight& light = list.lights[static_cast<std::size_t>(chosen[i])];
        const glm::vec3 along(query.along_x[i], query.along_y[i], query.along_z[i]),
            n(points.nx[i], points.ny[i], points.nz[i]);
        if (!(y.distance > 0.0f)) continue;
        const float geometry = glm::dot(along, n) * -glm::dot(along, y.normal) / (y.distance * y.distance);
        const float q = kappa * std::max(geometry, 0.0f) / (pi * per_m2[i]);
        found[i] = y.albedo * (light.weight * (brings[i] / light.luminance * q / (1.0f + q)));
        lit |= 1u << i;
        const glm::vec3 from = y.position + y.geometric * view.geometry.step_off(y.position);
        const glm::vec3 to = light.position - from;
        query.from_x[i] = from.x, query.from_y[i] = from.y, query.from_z[i] = from.z;
        query.along_x[i] = to.x, query.along_y[i] = to.y, query.along_z[i] = to.z;
        query.far[i] = 1.0f - 1e-5f;
    }
    if (lit == 0) return;
    const unsigned seen = lit & ~view.geometry.occluded(query, lit);
    for (int i = 0; i < trace::kPacket; ++i) {
        if ((seen >> i & 1u) == 0) continue;
        sums.red[i] += found[i].x, sums.green[i] += found[i].y, sums.blue[i] += found[i].z;
    }
}

}  // namespace gonio::shade
#endif
