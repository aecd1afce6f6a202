// Links: from each surfel cosine-distributed rays, each kept as the id of the surfel that it meets. Geometry stands
// still while lights and cameras move, so they are traced once (direct-to-indirect transfer, Hasan et al. 2006).
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <iterator>
#include <memory>
#include <span>
#include <vector>

#include "server/scene/haze.h"
#include "server/transport/cell_map.h"

namespace gonio::transport {

// Links first … first + count − 1 of every surfel: ids[surfel × count + k]; Surfels::count: nothing was met.
struct LinkSet {
    unsigned first = 0, count = 0;  // multiples of 16
    std::vector<std::uint16_t> ids;
};

// One set of both; b's follow a's.
std::shared_ptr<const LinkSet> join(const LinkSet& a, const LinkSet& b, std::size_t surfels);

// The same by where they lead: from[first[j]] … from[first[j + 1] − 1] are the surfels whose links meet surfel j, one
// for each link. For light that falls on few surfels.
struct ReverseLinks {
    unsigned count = 0;  // links of each surfel
    std::vector<std::uint32_t> first;
    std::vector<std::uint16_t> from;
};
ReverseLinks reverse(const LinkSet& set, std::size_t surfels);

// The generations of a surfel's links: an error falls by the root of how many there are. Those after the last are kept
// in reverse: a narrow beam lights so few surfels that a mean over 512 links is noisy.
inline constexpr unsigned kGenerations[] = {16, 32, 64, 128, 256, 512};
inline constexpr unsigned kMostForwardLinks = kGenerations[std::size(kGenerations) - 1];
inline constexpr unsigned kReverseGenerations[] = {1024, 2048};
inline constexpr unsigned kMostLinks = kReverseGenerations[std::size(kReverseGenerations) - 1];

// Result: those links of all surfels, Owen-scrambled Sobol points about the shading normal. Rays below the geometric
// one meet nothing. stopped: asked now and then; when true the result is null. Seven parameters: what is met, and
// which.
std::shared_ptr<const LinkSet> trace_links(const trace::Geometry& geometry, const Surfels& surfels,
                                           const CellMap& cells, unsigned first, unsigned count, Pool& pool,
                                           const std::function<bool()>& stopped);

// Sixteen rays from one point: the points first … first + 15 of its sequence.
struct Fan {
    trace::RayPacket rays;
    unsigned active = 0;
};
// Their directions about +Z: cosine-distributed. stream: which scrambling of the sequence.
using FanDirections = std::array<glm::vec3, trace::kPacket>;
FanDirections fan_directions(std::uint32_t stream, unsigned first);
// from: where they start.
Fan make_fan(const glm::vec3& from, const glm::vec3& normal, const glm::vec3& geometric,
             const FanDirections& directions);
// ids: of the surfels that the rays meet. hits: filled where a ray meets anything (result: bits). In the cells of a
// louvre that are finer than surfels lie apart no surfel may be in sight of a hit. Then the ray goes on as light does:
// absorbed by chance, or in a diffuse direction, for eight steps at most. walked: bits of these rays; null: nobody
// asks.
unsigned follow(const Fan& fan, const trace::Geometry& geometry, const Surfels& surfels, const CellMap& cells,
                trace::HitPacket& hits, std::uint16_t* ids, unsigned* walked = nullptr);

// Form factors from surfels to crowded ones, by Surfels::all_crowded. What number n sends comes to surfel to[k] times
// form_factor[k], for k = first[n] … first[n + 1] − 1. Empty where no surfel is crowded.
struct CrowdedLinks {
    std::vector<std::uint32_t> first;
    std::vector<std::uint16_t> to;
    std::vector<float> form_factor;
    template <typename Take>
    void each(std::size_t n, const Take& take) const {  // take(receiver, form factor)
        for (std::size_t k = first.empty() ? 0 : first[n]; k < (first.empty() ? 0 : first[n + 1]); ++k)
            take(std::size_t{to[k]}, form_factor[k]);
    }
};

// The links of a scene, as far as they are traced.
struct Links {
    std::vector<std::shared_ptr<const LinkSet>> sets;
    std::vector<std::shared_ptr<const ReverseLinks>> reversed;  // those after the sets
    std::shared_ptr<const CrowdedLinks> crowded;                // of the sets; null: none
    std::vector<float> passed;  // by surfel: passed_along_links(), of air that absorbs; empty: air absorbs nothing
    float passes(std::size_t surfel) const { return passed.empty() ? 1.0f : passed[surfel]; }
    unsigned per_surfel() const { return sets.empty() ? 0 : sets.back()->first + sets.back()->count; }
};

// Result: by surfel, the share of what it sends that arrives where its links lead, through air that absorbs. It is the
// mean over the first links of each surfel; those that meet nothing do not count. By reciprocity all surfels together
// send as much less as they receive less. absorption: local coordinates (server/scene/haze.h).
std::vector<float> passed_along_links(const Links& links, const Surfels& surfels, const Haze& absorption, Pool& pool);

// Result: by surfel, the area on which links meet it, m². A flux that lands on a surfel is divided by it, so that links
// carry all of the flux on. Surfels::area_m2 comes from a few points of each surfel and is off by a quarter. By
// reciprocity the links that meet a surfel, each with the area that it starts from, weigh as much as the surfel's own
// links that meet anything. Points and links count by how many are expected of each surfel.
std::vector<float> met_areas_m2(const Links& links, const Surfels& surfels);

// A crowded surfel is bright and small: few links meet it, and its light at others would be noise. Its own links meet
// the others as well, and by reciprocity both count the same form factor (Veach and Guibas 1995). The links of the
// other surfels count the less the larger those are, and alone where they are no larger: they need no area to be known.
// Reversed ones need both areas, and an error in a receiver's own area would scale all that comes to it. areas_m2:
// met_areas_m2().
CrowdedLinks crowded_links(const Links& links, const Surfels& surfels, std::span<const float> areas_m2);

}  // namespace gonio::transport
