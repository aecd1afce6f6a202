#include "server/transport/small_rooms.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/trace/sampler.h"
#include "server/transport/space_hash.h"

namespace gonio::transport {
namespace {

constexpr std::size_t kMostOffered = 8192, kMostPlaces = 16'384, kMostRooms = 512;
constexpr unsigned kPackets = 4, kRays = kPackets * trace::kPacket;  // rays from a place that measure its surroundings
constexpr unsigned kWithin = kRays * 9 / 10;                         // rays that must end within the room
constexpr unsigned kSurely = trace::kPacket * 3 / 4;  // of each packet; with fewer the place is in no room
constexpr float kApart = 0.4f;             // least distance between two places of a room, as a share of its size
constexpr float kFurther = 0.6f;           // share of the way to a surface at which the next place in a room is tried
constexpr float kSmallest = 1.0f / 16.0f;  // share of most_m below which a gap is a crack and no room
constexpr std::size_t kLooks = 1u << 17;   // points that look() draws
constexpr unsigned kMostSteps = 16;        // of the walks that tell whether light reaches a place
constexpr float kNoRoom = std::numeric_limits<float>::infinity();

// Result: the distance within which nine in ten rays from a place end, m; kNoRoom if it is more than most_m.
float size_at(const trace::Geometry& geometry, const glm::vec3& place, std::uint32_t stream, float most_m) {
    std::vector<float> lengths;
    for (unsigned packet = 0; packet < kPackets; ++packet) {
        const trace::RayPacket rays = rays_around(place, 0.0f, stream, packet * trace::kPacket, most_m);
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

// Result: whether one of sixteen walks from a place comes to a surface that light is known to reach.
bool reaches(const trace::Geometry& geometry, const glm::vec3& place, std::uint32_t stream, const Reached& reached) {
    trace::RayPacket rays = rays_around(place, 0.0f, stream, 0, std::numeric_limits<float>::infinity());
    trace::SurfaceHit at[trace::kPacket];
    unsigned active = ~0u >> (32 - trace::kPacket);
    for (unsigned step = 0; step < kMostSteps && active != 0; ++step) {
        active &= geometry.closest(rays, active, at, false);
        for (int i = 0; i < trace::kPacket; ++i) {
            if ((active >> i & 1u) == 0) continue;
            if (reached.sees(geometry, at[i].position, at[i].geometric)) return true;
            trace::Sample sample(trace::mix_bits(step, 0x2c1b3c6du),
                                 stream * trace::kPacket + static_cast<unsigned>(i));
            set_diffuse_step(rays, i, geometry, at[i], sample.next());
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
            set_diffuse_step(rays, static_cast<int>(count++), geometry, one.hit, sample.next(), most_m_);
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
    const auto full = [&] { return rooms.size() == kMostRooms; };
    const auto take = [&](const glm::vec3& place, float size_m) {
        if (size_m == kNoRoom || full()) return;
        const bool known = std::any_of(rooms.begin(), rooms.end(), [&](const NearSources::Source& other) {
            return glm::distance(other.position, place) < kApart * std::min(other.reach_m, size_m) &&
                   !geometry.occluded(other.position, place);
        });
        if (!known) rooms.push_back({place, size_m});
    };
    std::size_t spread = 0;
    for (std::size_t i = 0; i < places_.size() && !full() && !stopped(); ++i) {
        take(places_[i].at, sizes_m[i]);
        // One place in a room leads to others, until they cover the room.
        for (; spread < rooms.size() && !full() && !stopped(); ++spread) {
            const glm::vec3 from = rooms[spread].position;
            const auto stream = static_cast<std::uint32_t>(kMostPlaces + spread);
            const trace::RayPacket rays = rays_around(from, 0.0f, stream, 0, rooms[spread].reach_m);
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
