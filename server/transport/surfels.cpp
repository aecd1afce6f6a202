#include "server/transport/surfels.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "server/trace/sampler.h"
#include "server/transport/candidates.h"
#include "server/transport/near_sources.h"
#include "server/transport/reached.h"
#include "server/transport/small_rooms.h"
#include "server/transport/space_hash.h"
#include "server/transport/table.h"

namespace gonio::transport {
namespace {

constexpr float kCell = 3.0f;                 // side of the grid's cells, radii
constexpr float kNear = 1.3f, kReach = 2.5f;  // radii within which surfels are looked for, first and then
constexpr int kCandidates = 6;                // tried for each surfel that is wanted
// The spacing of surfels near a luminaire, as a share of the distance to it, and in a small room, as a share of the
// room's size. It is never below kClosest radii.
constexpr float kNearShare = 0.14f, kClosest = 0.08f;
// A room counts as small if the surfels' radius is more than this share of its size.
constexpr float kLargeShare = 0.2f;
// The most surfels that luminaires and small rooms may add, as shares of the wanted number.
constexpr double kMostNear = 0.05, kMostInRooms = 0.025;
// The rays give each surfel near a luminaire some fifty candidates where its surface faces the luminaire, and six once
// there are 64 luminaires. The candidates measure the surfels' areas, which limit how exact the light of a housing is.
constexpr NearSources::Bounds kNearLuminaires{16'384, 16}, kInRooms{4096, 128};
constexpr std::size_t kMostFound = 512;  // surfels that one search lists
constexpr int kPaths = 60'000, kPathLength = 8;

}  // namespace

std::uint32_t Surfels::cell_of(const glm::ivec3& cell) const {
    return hash_of(cell) & static_cast<std::uint32_t>(first_.size() - 2);
}

std::size_t Surfels::near(const trace::SurfacePoint& from, float radii, std::span<std::uint16_t> found) const {
    if (count == 0) return 0;
    const float side = kCell * radius_m, reach = radii * radius_m, r2 = radius_m * radius_m;
    struct Found {
        float distance;
        std::uint16_t id;
    };
    Found best[kMostFound];
    std::size_t size = 0;
    const std::size_t most = std::min(found.size(), std::size(best));
    const glm::ivec3 low = cell_at(from.position - reach, side), high = cell_at(from.position + reach, side);
    for (glm::ivec3 cell(low); cell.z <= high.z; ++cell.z) {
        for (cell.y = low.y; cell.y <= high.y; ++cell.y) {
            for (cell.x = low.x; cell.x <= high.x; ++cell.x) {
                const std::uint32_t bucket = cell_of(cell);
                for (std::uint32_t k = first_[bucket]; k < first_[bucket + 1]; ++k) {
                    const std::uint16_t id = ids_[k];
                    const glm::vec3 q = position(id), d = q - from.position;
                    const float d2 = glm::dot(d, d);
                    if (d2 > reach * reach || cell_at(q, side) != cell) continue;
                    const float agree = glm::dot(from.normal, normal(id));
                    if (agree <= 0.0f || glm::dot(from.geometric, geometric[id]) <= 0.0f) continue;
                    const float off = glm::dot(d, from.normal);
                    // Those that agree poorly come after all others.
                    const float distance =
                        d2 + 4.0f * off * off + 2.0f * r2 * (1.0f - agree) + (agree > 0.5f ? 0.0f : 1e3f * r2);
                    if (size == most && distance >= best[size - 1].distance) continue;
                    if (size < most) ++size;
                    std::size_t to = size - 1;
                    for (; to > 0 && best[to - 1].distance > distance; --to) best[to] = best[to - 1];
                    best[to] = {distance, id};
                }
            }
        }
    }
    for (std::size_t i = 0; i < size; ++i) found[i] = best[i].id;
    return size;
}

bool Surfels::sees(const trace::Geometry& geometry, const trace::SurfacePoint& from, std::size_t id) const {
    constexpr float kAbove = 0.5f;  // radii
    return in_sight(geometry, from.position, from.geometric, position(id), geometric[id], kAbove * radius_m);
}

std::uint16_t Surfels::visible_from(const trace::Geometry& geometry, const trace::SurfacePoint& from) const {
    std::uint16_t found[kMostFound];
    for (const float radii : {kNear, kReach}) {
        // The long list is for places where a luminaire has crowded surfels on the other side of a thin wall.
        std::size_t tried = 0;
        for (const std::size_t most : {2 * kNeighbours, kMostFound}) {
            const std::size_t size = near(from, radii, std::span(found).first(most));
            for (; tried < size; ++tried) {
                if (sees(geometry, from, found[tried])) return found[tried];
            }
            if (size < most) break;
        }
    }
    return static_cast<std::uint16_t>(count);
}

struct Placement {
    const trace::Geometry& geometry;
    std::span<const glm::vec3> seeds, sources;
    const SurfelSettings& settings;
    Pool& pool;
    const std::function<bool()>& stopped;
    Areas areas{geometry};
    std::vector<std::pair<int, int>> met_triangles{};  // by the walks: instance, triangle; ascending

    Surfels run() {
        Surfels surfels;
        double all_m2 = 2.0 * areas.running.back();  // of both sides
        if (!(all_m2 > 0.0) || seeds.empty()) return surfels;
        const auto wanted = [&](double m2) {
            return std::clamp(m2 / (settings.spacing_m * settings.spacing_m), static_cast<double>(settings.least),
                              static_cast<double>(settings.most));
        };
        // Half of all sides are inside walls and things, about.
        const double guess = wanted(0.5 * all_m2);
        const auto apart_m = static_cast<float>(std::sqrt(0.5 * all_m2 / guess));
        Reached reached(3.0f * apart_m, static_cast<std::size_t>(guess));
        SmallRooms small_rooms(kDartRadius / kLargeShare * apart_m);
        walk(reached, small_rooms);
        small_rooms.look(geometry, areas, pool, stopped);
        if (stopped()) return {};
        // A first, sparse set says how much of the area is reached.
        const auto drawn = [&](std::size_t number, std::uint32_t seed) {
            return candidates(geometry, areas, number, seed, reached, pool, stopped);
        };
        const auto sparse = [&] { return drawn(static_cast<std::size_t>(2.0 * guess), 0x51ed270bu); };
        std::vector<Candidate> few = sparse();
        // Light that stays in a housing of a large scene reaches a part of it that few of these points are in: then
        // they are drawn on the triangles that the walks met.
        constexpr double kLittle = 0.01;
        if (static_cast<double>(few.size()) < kLittle * 2.0 * guess) {
            areas = Areas(geometry, met_triangles);
            all_m2 = 2.0 * areas.running.back();
            if (!(all_m2 > 0.0)) return surfels;
            few = sparse();
        }
        const double reached_m2 = all_m2 * static_cast<double>(few.size()) / (2.0 * guess);
        const double count = wanted(reached_m2);
        if (few.empty() || stopped()) return {};
        surfels.radius_m = kDartRadius * static_cast<float>(std::sqrt(reached_m2 / count));
        const auto tried = static_cast<std::size_t>(kCandidates * count * all_m2 / std::max(reached_m2, 1e-3 * all_m2));
        areas.widen(0.5f * surfels.radius_m);
        std::vector<Candidate> all = drawn(tried, 0x2545f491u);
        if (stopped()) return {};
        const float small_m = surfels.radius_m / kLargeShare;
        crowd(all, small_rooms.found(geometry, reached, small_m, pool, stopped), tried, count, surfels.radius_m);
        if (stopped()) return {};
        throw_darts(all, surfels);
        make_grid(surfels);
        collect(all, surfels);
        if (stopped()) return {};
        find_neighbours(surfels);
        return surfels;
    }

    // Diffuse random walks from the seeds, kPathLength steps at a time. Those that came to new places go on from there:
    // few pass a keyhole, and late.
    void walk(Reached& reached, SmallRooms& small_rooms) {
        constexpr int kPackets = kPaths / trace::kPacket, kMostRounds = 32;
        struct Met {
            glm::vec3 from, position, normal;
            std::pair<int, int> triangle;
            int walker;
        };
        struct Walkers {
            trace::SurfaceHit at[trace::kPacket];
            unsigned active = ~0u >> (32 - trace::kPacket);
            std::vector<Met> met;
        };
        std::vector<Walkers> all(kPackets);
        for (int round = 0; round < kMostRounds && !stopped(); ++round) {
            pool.run(kPackets, [&](int packet) {
                Walkers& own = all[static_cast<std::size_t>(packet)];
                own.met.clear();
                trace::RayPacket rays;
                for (int k = 0; k < kPathLength && own.active != 0; ++k) {
                    const int step = round * kPathLength + k;
                    for (int i = 0; i < trace::kPacket; ++i) {
                        if ((own.active >> i & 1u) != 0)
                            set_step(rays, i, step, static_cast<std::uint32_t>(packet * trace::kPacket + i), own.at[i]);
                    }
                    own.active &= geometry.closest(rays, own.active, own.at, false);
                    for (int i = 0; i < trace::kPacket; ++i) {
                        const trace::SurfaceHit& at = own.at[i];
                        if ((own.active >> i & 1u) != 0)
                            own.met.push_back({rays.from(i), at.position, at.geometric, {at.instance, at.triangle}, i});
                    }
                }
            });
            bool any = false;
            for (Walkers& walkers : all) {
                if (stopped()) return;
                unsigned found = 0;
                for (const Met& one : walkers.met) {
                    if (reached.add(geometry, one.position, one.normal)) found |= 1u << one.walker;
                    small_rooms.offer(one.from, one.position);
                    met_triangles.push_back(one.triangle);
                }
                walkers.active &= found;
                any |= walkers.active != 0;
            }
            std::sort(met_triangles.begin(), met_triangles.end());
            met_triangles.erase(std::unique(met_triangles.begin(), met_triangles.end()), met_triangles.end());
            if (!any) break;
        }
    }
    // Ray i becomes a path's next one: from its seed in any direction, later from where it is.
    void set_step(trace::RayPacket& rays, int i, int step, std::uint32_t path, const trace::SurfaceHit& at) const {
        trace::Sample sample(trace::mix_bits(static_cast<std::uint32_t>(step), 0x68bc21ebu), path);
        const glm::vec2 random = sample.next();
        if (step > 0) return set_diffuse_step(rays, i, geometry, at, random);
        const glm::vec3 from = seeds[path % seeds.size()], d = trace::any_direction(random);
        rays.set(i, from + d * geometry.step_off(from), d);
    }

    // Adds candidates near the sources and in small rooms, so that surfels can lie closer together there, and says how
    // close. drawn: so many were, for which `all` are left.
    void crowd(std::vector<Candidate>& all, std::vector<NearSources::Source> rooms, std::size_t drawn, double count,
               float radius_m) {
        std::vector<NearSources::Source> luminaires;
        for (const glm::vec3& source : sources) luminaires.push_back({source, radius_m / kNearShare});
        const NearSources near_luminaires(geometry, std::move(luminaires), kNearLuminaires),
            in_rooms(geometry, std::move(rooms), kInRooms);
        const std::size_t evenly = all.size();
        for (const NearSources* sampled : {&near_luminaires, &in_rooms}) {
            for (const NearSources::End& end : sampled->rays(pool, stopped)) {
                trace::SurfaceHit hit;
                if (!geometry.surface_at(end.instance, end.triangle, end.u, end.v, end.front, hit)) continue;
                const std::size_t own = areas.find(end.instance, end.triangle);
                // On a triangle that no point was drawn on, rays alone count.
                const double drawn_m2 =
                    own == areas.triangles.size() ? std::numeric_limits<double>::infinity() : areas.each_m2(own, drawn);
                all.push_back(candidate_at(geometry, hit, end.u, end.v, drawn_m2));
            }
        }
        pool.run_chunks(all.size(), 1024, [&](std::size_t first, std::size_t size) {
            if (stopped()) return;
            for (std::size_t i = first; i < first + size; ++i) {
                const NearSources::Near near = near_luminaires.at(all[i]), room = in_rooms.at(all[i]);
                const double rays_per_m2 = (near.rays_per_m2 + room.rays_per_m2) * static_cast<double>(all[i].covered);
                all[i].near_m = near.distance_m;
                all[i].room_m = room.reach_m;
                all[i].lit = near.rays_per_m2;
                // Points of all kinds are this dense together (Veach and Guibas 1995, balance heuristic).
                all[i].area_m2 = 1.0 / (1.0 / all[i].area_m2 + rays_per_m2);
                // Rounding: a ray ends where its own source does not see the point.
                if (i >= evenly && !(rays_per_m2 > 0.0)) all[i].area_m2 = 0.0;
            }
        });
        std::erase_if(all, [](const Candidate& one) { return !(one.area_m2 > 0.0); });
        for (Candidate& one : all) one.spacing_m = radius_m;
        for (const auto& [length_m, most] :
             {std::pair(&Candidate::near_m, kMostNear), std::pair(&Candidate::room_m, kMostInRooms)}) {
            const auto spacing = [&](const Candidate& one, float share) {
                return glm::clamp(share * one.*length_m, kClosest * radius_m, one.spacing_m);
            };
            // If that makes too many surfels, they crowd less, until their number is in bounds.
            float share = kNearShare;
            const auto added = [&] {
                double sum = 0.0;
                for (const Candidate& one : all) {
                    const double less = static_cast<double>(spacing(one, share)),
                                 more = static_cast<double>(one.spacing_m);
                    sum += one.area_m2 * static_cast<double>(kDartRadius * kDartRadius) *
                           (1.0 / (less * less) - 1.0 / (more * more));
                }
                return sum;
            };
            while (added() > most * count) share *= 1.25f;
            for (Candidate& one : all) one.spacing_m = spacing(one, share);
        }
    }

    void throw_darts(const std::vector<Candidate>& all, Surfels& surfels) {
        std::vector<std::uint64_t> order(all.size());  // random bits and, below them, which candidate
        for (std::uint32_t i = 0; i < all.size(); ++i)
            order[i] = std::uint64_t{trace::mix_bits(i, 0x9e3779b9u)} << 32 | i;
        std::sort(order.begin(), order.end());
        const float r = surfels.radius_m, side = 2.0f * r;
        const std::uint32_t buckets = power_of_two(4 * settings.most);
        constexpr std::uint32_t kEnd = ~0u;
        struct Taken {
            glm::vec3 position, normal;
            std::uint32_t next, which;
        };
        std::vector<std::uint32_t> head(buckets, kEnd);
        std::vector<Taken> taken;
        const auto conflicts = [&](const Candidate& c) {
            // The cells that a sphere of radius r meets: two along each axis at most.
            const glm::ivec3 low = cell_at(c.position - r, side), span = cell_at(c.position + r, side) - low;
            for (int k = 0; k < 8; ++k) {
                const glm::ivec3 step(k & 1, k >> 1 & 1, k >> 2);
                if (glm::any(glm::greaterThan(step, span))) continue;
                for (std::uint32_t s = head[hash_of(low + step) & (buckets - 1)]; s != kEnd; s = taken[s].next) {
                    const Taken& other = taken[s];
                    const glm::vec3 d = other.position - c.position;
                    const float off = glm::dot(d, c.normal);
                    if (glm::dot(d, d) + 3.0f * off * off < c.spacing_m * c.spacing_m &&
                        glm::dot(other.normal, c.normal) > std::numbers::sqrt2_v<float> / 2.0f)
                        return true;
                }
            }
            return false;
        };
        for (const std::uint64_t random : order) {
            const auto i = static_cast<std::uint32_t>(random);
            if (taken.size() == kMostSurfels - 1) break;
            const Candidate& one = all[i];
            if (conflicts(one)) continue;
            std::uint32_t& bucket = head[hash_of(cell_at(one.position, side)) & (buckets - 1)];
            taken.push_back({one.position, one.normal, bucket, i});
            bucket = static_cast<std::uint32_t>(taken.size() - 1);
        }
        // Neighbours in space are neighbours in memory.
        const auto code = [&](std::uint32_t i) {
            const glm::vec3 share =
                glm::clamp((all[i].position + geometry.extent()) / (2.0f * geometry.extent()), 0.0f, 1.0f);
            std::uint64_t bits = 0;
            for (int axis = 0; axis < 3; ++axis) {
                const auto q = static_cast<std::uint64_t>(share[axis] * 1048575.0f);
                for (int b = 0; b < 20; ++b) bits |= (q >> b & 1u) << (3 * b + axis);
            }
            return bits;
        };
        std::vector<std::pair<std::uint64_t, std::uint32_t>> sorted;
        for (const Taken& one : taken) sorted.emplace_back(code(one.which), one.which);
        std::sort(sorted.begin(), sorted.end());
        surfels.count = sorted.size();
        for (std::vector<float>& values : surfels.points)
            values.assign((surfels.count + 2 * kPadding) / kPadding * kPadding, 0.0f);
        for (std::vector<float>& values : surfels.facing) values.assign(surfels.points[0].size(), 0.0f);
        for (std::size_t i = 0; i < surfels.count; ++i) {
            const Candidate& c = all[sorted[i].second];
            for (int k = 0; k < 3; ++k) {
                surfels.points[k][i] = c.position[k], surfels.points[k + 3][i] = c.normal[k];
                surfels.facing[k][i] = c.detailed[k];
            }
            surfels.detailed |= c.detailed != c.normal;
            surfels.geometric.push_back(c.geometric);
            surfels.albedo.push_back(c.albedo);
            surfels.spacing_m.push_back(c.spacing_m);
            surfels.drawn.push_back(drawn_at(c, surfels.radius_m));
        }
    }

    // Result: how many candidates say how large a surfel is that lies there, on the mean.
    static float drawn_at(const Candidate& at, float radius_m) {
        constexpr float kNeighboursToo = 16.0f;  // find_neighbours() averages over those around
        if (!(at.spacing_m < radius_m)) return kNeighboursToo;
        const double side_m = static_cast<double>(at.spacing_m / kDartRadius);
        return static_cast<float>(side_m * side_m / at.area_m2);
    }

    static void make_grid(Surfels& s) {
        const std::uint32_t cells = power_of_two(s.count);
        s.first_.assign(cells + 1, 0);
        const float side = kCell * s.radius_m;
        std::vector<std::uint32_t> cell(s.count);
        for (std::size_t i = 0; i < s.count; ++i) {
            cell[i] = hash_of(cell_at(s.position(i), side)) & (cells - 1);
            ++s.first_[cell[i] + 1];
        }
        std::partial_sum(s.first_.begin(), s.first_.end(), s.first_.begin());
        std::vector<std::uint32_t> next(s.first_.begin(), s.first_.end() - 1);
        s.ids_.resize(s.count);
        for (std::size_t i = 0; i < s.count; ++i) s.ids_[next[cell[i]]++] = static_cast<std::uint16_t>(i);
    }

    // Chooses where direct light falls on each crowded surfel.
    static void choose_lit(const std::vector<Candidate>& all, const std::vector<std::uint16_t>& nearest, Surfels& s) {
        std::vector<std::vector<CellMember>> members(s.count);
        for (std::size_t i = 0; i < all.size(); ++i)
            if (nearest[i] != s.count && s.crowded(nearest[i]))
                members[nearest[i]].push_back({all[i].position, all[i].area_m2, all[i].lit});
        for (std::size_t i = 0; i < s.count; ++i)
            if (s.crowded(i))
                s.all_crowded.push_back(
                    {static_cast<std::uint16_t>(i), cell_points(members[i], s.position(i), s.spacing_m[i])});
    }

    // What the candidates nearest to each surfel look like, on the mean, and how much area they stand for.
    void collect(const std::vector<Candidate>& all, Surfels& s) {
        std::vector<std::uint16_t> nearest(all.size());
        pool.run_chunks(all.size(), 1024, [&](std::size_t first, std::size_t count) {
            if (stopped()) return;
            // In sight: small surfels in front of a sheet are nearer to its points than the sheet's own.
            for (std::size_t i = first; i < first + count; ++i) nearest[i] = s.visible_from(geometry, all[i]);
        });
        choose_lit(all, nearest, s);
        // Means are weighted by area, because candidates near sources stand for less of it. A surfel that is nearest to
        // no candidate keeps its own values.
        const float itself_m2 = 1e-6f * s.radius_m * s.radius_m;
        std::vector<float> members_m2(s.count, itself_m2);
        for (std::size_t i = 0; i < s.count; ++i) {
            s.albedo[i] *= itself_m2;
            for (int k = 0; k < 3 && s.detailed; ++k) s.facing[k][i] *= itself_m2;
        }
        for (std::size_t i = 0; i < all.size(); ++i) {
            const std::size_t to = nearest[i];
            if (to == s.count) continue;
            // A pane stops part of the light: links meet that much less of it.
            const float m2 = static_cast<float>(all[i].area_m2) * all[i].covered;
            members_m2[to] += m2;
            s.albedo[to] += m2 * all[i].albedo;
            for (int k = 0; k < 3 && s.detailed; ++k) s.facing[k][to] += m2 * all[i].detailed[k];
        }
        for (std::size_t i = 0; i < s.count; ++i) {
            s.albedo[i] /= members_m2[i];
            for (int k = 0; k < 3 && s.detailed; ++k) s.facing[k][i] /= members_m2[i];
        }
        s.area_m2 = std::move(members_m2);
    }

    void find_neighbours(Surfels& s) {
        s.neighbours.resize(s.count);
        pool.run_chunks(s.count, 256, [&](std::size_t first, std::size_t count) {
            if (stopped()) return;
            for (std::size_t i = first; i < first + count; ++i) {
                const trace::SurfacePoint at = s.at(i);
                std::uint16_t found[2 * kNeighbours];
                const std::size_t size = s.near(at, kReach, found);
                auto& own = s.neighbours[i];
                own.fill(static_cast<std::uint16_t>(s.count));
                own[0] = static_cast<std::uint16_t>(i);
                std::size_t next = 1;
                for (std::size_t k = 0; k < size && next < kNeighbours; ++k) {
                    if (found[k] != i && s.sees(geometry, at, found[k])) own[next++] = found[k];
                }
            }
        });
        // A few candidates say little of one surfel's area. Those around are as large in relation to their spacing, and
        // all of them together have what they had. Crowded surfels have some fifty candidates each and keep their own
        // areas: on the few around a luminaire in a housing the mean over neighbours would be 5 to 8 % too large.
        std::vector<float> areas_m2(s.area_m2);
        double before_m2 = 0.0, after_m2 = 0.0;
        for (std::size_t i = 0; i < s.count; ++i) {
            if (s.crowded(i)) continue;
            const auto squared = [&](std::size_t j) { return s.spacing_m[j] * s.spacing_m[j]; };
            float weights[kNeighbours];
            weigh(s, s.neighbours[i].data(), s.position(i), s.normal(i), weights);
            areas_m2[i] = 0.0f;
            for (std::size_t k = 0; k < kNeighbours; ++k) {
                const std::size_t j = s.neighbours[i][k];
                if (j != s.count) areas_m2[i] += weights[k] * squared(i) * (s.area_m2[j] / squared(j));
            }
            before_m2 += static_cast<double>(s.area_m2[i]), after_m2 += static_cast<double>(areas_m2[i]);
        }
        const double right = after_m2 > 0.0 ? before_m2 / after_m2 : 1.0;
        for (std::size_t i = 0; i < s.count; ++i)
            if (!s.crowded(i)) areas_m2[i] *= static_cast<float>(right);
        s.area_m2 = std::move(areas_m2);
    }
};

Surfels place_surfels(const trace::Geometry& geometry, std::span<const glm::vec3> seeds, std::size_t sources,
                      const SurfelSettings& settings, Pool& pool, const std::function<bool()>& stopped) {
    return Placement{geometry, seeds, seeds.first(sources), settings, pool, stopped}.run();
}

}  // namespace gonio::transport
