#include "server/transport/links.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "server/trace/sampler.h"
#include "server/transport/reached.h"

namespace gonio::transport {

FanDirections fan_directions(std::uint32_t stream, unsigned first) {
    const std::uint32_t u = trace::mix_bits(stream, 0x3c6ef372u), v = trace::mix_bits(stream, 0xa54ff53au);
    FanDirections directions;
    for (unsigned i = 0; i < trace::kPacket; ++i)
        directions[i] = trace::cosine_hemisphere(trace::scrambled_pair(first + i, u, v));
    return directions;
}

Fan make_fan(const glm::vec3& from, const glm::vec3& normal, const glm::vec3& geometric,
             const FanDirections& directions) {
    Fan fan;
    for (unsigned i = 0; i < trace::kPacket; ++i) {
        const glm::vec3 d = trace::around(normal, directions[i]);
        fan.rays.set(static_cast<int>(i), from, d);
        if (glm::dot(d, geometric) > 0.0f) fan.active |= 1u << i;
    }
    return fan;
}

namespace {

struct End {
    unsigned instance, triangle;
    float u, v;
    bool front;  // of the triangle, is met
};

End end_of(const trace::RayPacket& rays, const trace::HitPacket& hits, int i) {
    return {hits.instance[i], hits.triangle[i], hits.u[i], hits.v[i], glm::dot(rays.along(i), hits.normal(i)) < 0.0f};
}

// Result: the surfel that a diffuse walk from there comes to, or Surfels::count.
std::uint16_t walk_on(End end, const trace::Geometry& geometry, const Surfels& surfels, const CellMap& cells) {
    constexpr std::uint32_t kMostSteps = 8;
    const std::uint32_t stream =
        trace::mix_bits(std::bit_cast<std::uint32_t>(end.u), std::bit_cast<std::uint32_t>(end.v));
    const auto none = static_cast<std::uint16_t>(surfels.count);
    trace::RayPacket rays;
    trace::HitPacket hits;
    trace::SurfaceHit hit;
    for (std::uint32_t step = 0; step < kMostSteps; ++step) {
        trace::Sample sample(stream, step);
        if (!geometry.surface_at(static_cast<int>(end.instance), static_cast<int>(end.triangle), end.u, end.v,
                                 end.front, hit) ||
            sample.next().x >= trace::luminous(hit.albedo))
            return none;
        set_diffuse_step(rays, 0, geometry, hit, sample.next());
        if (geometry.closest(rays, 1u, hits) == 0) return none;
        end = end_of(rays, hits, 0);
        const std::uint16_t id = cells.surfel_at(end.instance, end.triangle, end.u, end.v, end.front);
        if (id != none) return id;
    }
    return none;
}

}  // namespace

unsigned follow(const Fan& fan, const trace::Geometry& geometry, const Surfels& surfels, const CellMap& cells,
                trace::HitPacket& hits, std::uint16_t* ids, unsigned* walked) {
    if (walked != nullptr) *walked = 0;
    const unsigned met = geometry.closest(fan.rays, fan.active, hits);
    for (int i = 0; i < trace::kPacket; ++i) {
        ids[i] = static_cast<std::uint16_t>(surfels.count);
        if ((met >> i & 1u) == 0) continue;
        const End end = end_of(fan.rays, hits, i);
        ids[i] = cells.surfel_at(end.instance, end.triangle, end.u, end.v, end.front);
        if (ids[i] != surfels.count) continue;
        if (walked != nullptr) *walked |= 1u << i;
        ids[i] = walk_on(end, geometry, surfels, cells);
    }
    return met;
}

std::shared_ptr<const LinkSet> join(const LinkSet& a, const LinkSet& b, std::size_t surfels) {
    auto both = std::make_shared<LinkSet>(LinkSet{a.first, a.count + b.count, {}});
    both->ids.reserve(surfels * both->count);
    for (std::size_t i = 0; i < surfels; ++i) {
        for (const LinkSet* set : {&a, &b}) {
            const auto from = set->ids.begin() + static_cast<std::ptrdiff_t>(i * set->count);
            both->ids.insert(both->ids.end(), from, from + set->count);
        }
    }
    return both;
}

std::shared_ptr<const LinkSet> trace_links(const trace::Geometry& geometry, const Surfels& surfels,
                                           const CellMap& cells, unsigned first, unsigned count, Pool& pool,
                                           const std::function<bool()>& stopped) {
    auto set = std::make_shared<LinkSet>();
    set->first = first;
    set->count = count;
    set->ids.resize((surfels.count + 1) * count, static_cast<std::uint16_t>(surfels.count));
    constexpr std::size_t kChunk = 64;
    pool.run_chunks(surfels.count, kChunk, [&](std::size_t begin, std::size_t size) {
        trace::HitPacket hits;
        auto crowded = std::lower_bound(surfels.all_crowded.begin(), surfels.all_crowded.end(), begin,
                                        [](const auto& one, std::size_t id) { return one.id < id; });
        for (std::size_t i = begin; i < begin + size && !stopped(); ++i) {
            const glm::vec3 mean = surfels.detailed_normal(i);
            // Where normal maps point every way the mean says nothing.
            const float length = glm::length(mean);
            const glm::vec3 normal = surfels.detailed && length > 0.1f ? mean / length : surfels.normal(i);
            // From the centre of its cell alone, the links of a small surfel see too little of the wall that begins
            // beside it. All surfels would then meet those around a luminaire in a housing 4.5 % too often.
            const CellPoints* own =
                crowded != surfels.all_crowded.end() && crowded->id == i ? &crowded++->points : nullptr;
            for (unsigned k = 0; k < count; k += trace::kPacket) {
                const glm::vec3 p = own ? own->at[(first + k) / trace::kPacket % kCellPoints] : surfels.position(i),
                                from = p + surfels.geometric[i] * geometry.step_off(p);
                follow(make_fan(from, normal, surfels.geometric[i],
                                fan_directions(static_cast<std::uint32_t>(i), first + k)),
                       geometry, surfels, cells, hits, set->ids.data() + i * count + k);
            }
        }
    });
    return stopped() ? nullptr : set;
}

ReverseLinks reverse(const LinkSet& set, std::size_t surfels) {
    ReverseLinks result;
    result.count = set.count;
    result.first.assign(surfels + 2, 0);
    const std::size_t links = surfels * set.count;
    for (std::size_t k = 0; k < links; ++k) ++result.first[set.ids[k] + 1u];
    for (std::size_t j = 0; j <= surfels; ++j) result.first[j + 1] += result.first[j];
    std::vector<std::uint32_t> next(result.first.begin(), result.first.end() - 1);
    result.from.resize(links);
    for (std::size_t k = 0; k < links; ++k) result.from[next[set.ids[k]]++] = static_cast<std::uint16_t>(k / set.count);
    result.from.resize(result.first[surfels]);  // those that meet nothing are the last
    return result;
}

namespace {

template <typename Take>
void each_link(const Links& links, const Surfels& surfels, const Take& take) {  // take(from, to)
    for (const auto& set : links.sets) {
        const std::uint16_t* to = set->ids.data();
        for (std::size_t i = 0; i < surfels.count; ++i)
            for (unsigned k = 0; k < set->count; ++k) take(i, std::size_t{*to++});
    }
}

}  // namespace

std::vector<float> passed_along_links(const Links& links, const Surfels& surfels, const Haze& absorption, Pool& pool) {
    constexpr unsigned kLinks = 32;  // of each surfel
    std::vector<float> passed(surfels.count, 1.0f);
    if (links.sets.empty()) return passed;
    const LinkSet& set = *links.sets.front();
    pool.run_chunks(surfels.count, kSurfelsAJob, [&](std::size_t first, std::size_t size) {
        for (std::size_t i = first; i < first + size; ++i) {
            double sum = 0.0, met = 0.0;
            for (unsigned k = 0; k < std::min(kLinks, set.count); ++k) {
                const std::size_t j = set.ids[i * set.count + k];
                if (j == surfels.count) continue;
                sum += transmittance(absorption, glm::dvec3(surfels.position(i)), glm::dvec3(surfels.position(j)));
                met += 1.0;
            }
            if (met > 0.0) passed[i] = static_cast<float>(sum / met);
        }
    });
    return passed;
}

std::vector<float> met_areas_m2(const Links& links, const Surfels& surfels) {
    if (links.sets.empty()) return surfels.area_m2;
    std::vector<float> own(surfels.count, 0.0f);  // links that meet a surfel
    each_link(links, surfels, [&](std::size_t i, std::size_t j) { own[i] += j != surfels.count ? 1.0f : 0.0f; });
    // The first time the areas that links start from are as rough as Surfels::area_m2, the second time no more.
    std::vector<float> areas_m2(surfels.area_m2);
    for (int times = 0; times < 2; ++times) {
        std::vector<double> come_m2(surfels.count + 1, 0.0);  // areas from which links come
        each_link(links, surfels,
                  [&](std::size_t i, std::size_t j) { come_m2[j] += static_cast<double>(areas_m2[i]); });
        // come / each = area × own / each
        for (std::size_t j = 0; j < surfels.count; ++j) {
            // As many as are expected: by those that come the surfels that many meet by chance would count for more.
            const float size = surfels.spacing_m[j] / surfels.radius_m, expected = size * size * own[j];
            if (!(expected > 0.0f)) continue;
            // Where it comes out larger than points could say, the centre sees less of the scene than the rest of the
            // surfel does, as where walls pass through each other.
            constexpr float kDeviations = 4.0f;  // of how many points there are
            const float each_m2 = surfels.full_m2(j) / surfels.drawn[j],
                        off_m2 = kDeviations * std::sqrt(each_m2 * std::max(surfels.area_m2[j], each_m2)),
                        met_m2 = std::min(static_cast<float>(come_m2[j]) / own[j], surfels.area_m2[j] + off_m2);
            areas_m2[j] = (surfels.drawn[j] * surfels.area_m2[j] + expected * met_m2) / (surfels.drawn[j] + expected);
        }
    }
    return areas_m2;
}

CrowdedLinks crowded_links(const Links& links, const Surfels& surfels, std::span<const float> areas_m2) {
    CrowdedLinks result;
    if (surfels.all_crowded.empty() || links.sets.empty()) return result;
    constexpr std::uint32_t kNone = ~0u;
    std::vector<std::uint32_t> number(surfels.count + 1, kNone);  // in all_crowded
    const std::size_t count = surfels.all_crowded.size();
    for (std::uint32_t n = 0; n < count; ++n) number[surfels.all_crowded[n].id] = n;
    const float share = 1.0f / static_cast<float>(links.per_surfel());
    // Each link to or from a crowded surfel, by its number: the receiver's id, doubled, and 1 where the link starts at
    // the crowded one.
    const auto each = [&](const auto& take) {
        each_link(links, surfels, [&](std::size_t i, std::size_t j) {
            if (j == surfels.count) return;
            if (number[j] != kNone) take(number[j], static_cast<std::uint32_t>(2 * i));
            if (number[i] != kNone) take(number[i], static_cast<std::uint32_t>(2 * j + 1));
        });
    };
    std::vector<std::uint32_t> first(count + 2, 0);
    each([&](std::size_t n, std::uint32_t) { ++first[n + 2]; });
    for (std::size_t n = 2; n < first.size(); ++n) first[n] += first[n - 1];
    std::vector<std::uint32_t> to(first.back());
    each([&](std::size_t n, std::uint32_t link) { to[first[n + 1]++] = link; });
    result.first.push_back(0);
    for (std::size_t n = 0; n < count; ++n) {
        const std::size_t j = surfels.all_crowded[n].id;
        const auto begin = to.begin() + first[n], end = to.begin() + first[n + 1];
        std::sort(begin, end);
        for (auto one = begin; one != end;) {
            const std::uint32_t i = *one / 2;
            const auto reversed = std::lower_bound(one, end, 2 * i + 1), next = std::upper_bound(one, end, 2 * i + 1);
            const float ratio = surfels.spacing_m[j] / surfels.spacing_m[i], own = std::min(ratio * ratio, 1.0f),
                        form_factor = own * static_cast<float>(reversed - one) +
                                      (1.0f - own) * static_cast<float>(next - reversed) * areas_m2[j] / areas_m2[i];
            if (form_factor > 0.0f) {
                result.to.push_back(static_cast<std::uint16_t>(i));
                result.form_factor.push_back(share * form_factor);
            }
            one = next;
        }
        result.first.push_back(static_cast<std::uint32_t>(result.to.size()));
    }
    return result;
}

}  // namespace gonio::transport
