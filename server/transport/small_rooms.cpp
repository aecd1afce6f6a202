#include "server/transport/small_rooms.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/trace/sampler.h"
#include "server/transport/space_hash.h"

namespace gonio::transport {
namespace {

constexpr std::size_t kMostOffered = 8192, kMostPlaces = 16'384, kMostRooms = 512;
constexpr unsigned kPackets = 4, kRays = kPackets * trace::kPacket;
constexpr unsigned kWithin = kRays * 9 / 10;          // rays that end in the room
constexpr unsigned kSurely = trace::kPacket * 3 / 4;  // of each packet: with fewer no more are sent
constexpr float kApart = 0.4f;                        // of the smaller of two rooms: how near places of one may be
constexpr float kFurther = 0.6f;                      // of the way to a surface: where else in a room a place may be
constexpr float kSmallest = 1.0f / 16.0f;             // of most_m: what is shorter is a crack

constexpr std::size_t kLooks = 1u << 17;  // points that are drawn
constexpr unsigned kMostSteps = 16;

constexpr float kNoRoom = std::numeric_limits<float>::infinity();

trace::RayPacket rays_around(const glm::vec3& place, std::uint32_t stream, unsigned first, float most_m) {
    trace::RayPacket rays;
    const std::uint32_t u = trace::mix_bits(stream, 0x7f4a7c15u), v = trace::mix_bits(stream, 0x1b873593u);
    for (unsigned i = 0; i < trace::kPacket; ++i)
        rays.set(static_cast<int>(i), place, trace::any_direction(trace::scrambled_pair(first + i, u, v)), most_m);
    return rays;
}

// Result: how far nine in ten of all directions lead from a place, m; kNoRoom: further than most_m.
float size_at(const trace::Geometry& geometry, const glm::vec3& place, std::uint32_t stream, float most_m) {
    std::vector<float> lengths;
    for (unsigned packet = 0; packet < kPackets; ++packet) {
        const trace::RayPacket rays = rays_around(place, stream, packet * trace::kPacket, most_m);
        trace::HitPacket hits;
        const unsigned met = geometry.closest(rays, ~0u >> (32 - trace::kPacket), hits);
        for (int i = 0; i < trace::kPacket; ++i)
            if ((met >> i & 1u) != 0) lengths.push_back(hits.distance[i]);
        if (lengths.size() < kSurely * (packet + 1)) return kNoRoom;
    }
    if (lengths.size() < kWithin) return kNoRoom;
    std::nth_element(lengths.begin(), lengths.begin() + (kWithin - 1), lengths.end());
    return lengths[kWithin - 1];
}

// Result: whether one of sixteen walks comes to where light is known to come.
bool reaches(const trace::Geometry& geometry, const glm::vec3& place, std::uint32_t stream, const Reached& reached) {
    trace::RayPacket rays = rays_around(place, stream, 0, kNoRoom);
    trace::SurfaceHit at[trace::kPacket];
    unsigned active = ~0u >> (32 - trace::kPacket);
    for (unsigned step = 0; step < kMostSteps && active != 0; ++step) {
        active &= geometry.closest(rays, active, at, false);
        for (int i = 0; i < trace::kPacket; ++i) {
            if ((active >> i & 1u) == 0) continue;
            if (reached.sees(geometry, at[i].position, at[i].geometric)) return true;
            trace::Sample sample(trace::mix_bits(step, 0x2c1b3c6du),
                                 stream * trace::kPacket + static_cast<unsigned>(i));
            rays.set(i, at[i].position + at[i].geometric * geometry.step_off(at[i].position),
                     trace::around(at[i].geometric, trace::cosine_hemisphere(sample.next())));
        }
    }
    return false;
}

}  // namespace

void SmallRooms::offer(const glm::vec3& from, const glm::vec3& to) {
    keep(from, to, false);
}

void SmallRooms::keep(const glm::vec3& from, const glm::vec3& to, bool doubtful) {
    const float length_m = glm::distance(from, to);
    if (!(length_m < most_m_) || length_m < kSmallest * most_m_ ||
        places_.size() >= (doubtful ? kMostPlaces : kMostOffered))
        return;
    const glm::vec3 middle = 0.5f * (from + to);
    const int level = std::ilogb(length_m);
    const std::uint64_t cell = hash_of(cell_at(middle, std::ldexp(1.0f, level)));
    if (known_.insert(cell << 8 | static_cast<std::uint64_t>(level + 128)).second)
        places_.push_back({middle, doubtful});
}

void SmallRooms::look(const trace::Geometry& geometry, const Areas& areas, Pool& pool,
                      const std::function<bool()>& stopped) {
    constexpr std::size_t kChunk = 1024;
    std::vector<std::vector<std::pair<glm::vec3, glm::vec3>>> ways(kLooks / kChunk);
    pool.run_chunks(kLooks, kChunk, [&](std::size_t first, std::size_t size) {
        if (stopped()) return;
        trace::RayPacket rays;
        unsigned count = 0;
        const auto send = [&] {
            trace::HitPacket hits;
            const unsigned met = count > 0 ? geometry.closest(rays, ~0u >> (32 - count), hits) : 0;
            for (int i = 0; i < trace::kPacket; ++i)
                if ((met >> i & 1u) != 0) ways[first / kChunk].emplace_back(rays.from(i), rays.at(i, hits.distance[i]));
            count = 0;
        };
        each_drawn(geometry, areas, kLooks, 0x68bc21ebu, first, size, [&](const Drawn& one) {
            trace::Sample sample(0x2c1b3c6du, one.index);
            rays.set(static_cast<int>(count++),
                     one.hit.position + one.hit.geometric * geometry.step_off(one.hit.position),
                     trace::around(one.hit.geometric, trace::cosine_hemisphere(sample.next())), most_m_);
            if (count == trace::kPacket) send();
        });
        send();
    });
    for (const auto& some : ways)
        for (const auto& [from, to] : some) keep(from, to, true);
}

std::vector<NearSources::Source> SmallRooms::found(const trace::Geometry& geometry, const Reached& reached,
                                                   float most_m, Pool& pool,
                                                   const std::function<bool()>& stopped) const {
    const auto lit_size_at = [&](const Place& place, std::uint32_t stream) {
        const float size_m = size_at(geometry, place.at, stream, most_m);
        return size_m == kNoRoom || !place.doubtful || reaches(geometry, place.at, stream, reached) ? size_m : kNoRoom;
    };
    std::vector<float> sizes_m(places_.size(), kNoRoom);
    pool.run_chunks(places_.size(), 64, [&](std::size_t first, std::size_t count) {
        if (stopped()) return;
        for (std::size_t i = first; i < first + count; ++i)
            sizes_m[i] = lit_size_at(places_[i], static_cast<std::uint32_t>(i));
    });
    std::vector<NearSources::Source> rooms;
    const auto take = [&](const glm::vec3& place, float size_m) {
        if (size_m == kNoRoom || rooms.size() == kMostRooms) return;
        const bool known = std::any_of(rooms.begin(), rooms.end(), [&](const NearSources::Source& other) {
            return glm::distance(other.position, place) < kApart * std::min(other.reach_m, size_m) &&
                   !geometry.occluded(other.position, place);
        });
        if (!known) rooms.push_back({place, size_m});
    };
    std::size_t spread = 0;
    for (std::size_t i = 0; i < places_.size() && !stopped(); ++i) {
        take(places_[i].at, sizes_m[i]);
        // From one place to all of its room.
        for (; spread < rooms.size() && !stopped(); ++spread) {
            const glm::vec3 from = rooms[spread].position;
            const auto stream = static_cast<std::uint32_t>(kMostPlaces + spread);
            const trace::RayPacket rays = rays_around(from, stream, 0, rooms[spread].reach_m);
            trace::HitPacket hits;
            const unsigned met = geometry.closest(rays, ~0u >> (32 - trace::kPacket), hits);
            for (int k = 0; k < trace::kPacket; ++k) {
                if ((met >> k & 1u) == 0) continue;
                const glm::vec3 place = rays.at(k, kFurther * hits.distance[k]);
                take(place, size_at(geometry, place, stream + static_cast<std::uint32_t>(k), most_m));
            }
        }
    }
    return rooms;
}

}  // namespace gonio::transport
