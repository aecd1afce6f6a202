#include "tests/bench/ray_rates.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <functional>

#include "server/scene/apply.h"
#include "server/shade/near_light.h"
#include "server/shade/occlusion.h"
#include "server/trace/sampler.h"
#include "tests/bench/cases.h"

namespace gonio::bench {
namespace {

struct Packet {
    trace::RayPacket rays;
    unsigned active = 0;
};

// Result: `rays` over the seconds that the jobs take on all threads, the best of several runs.
double rate(Pool& pool, int jobs, double rays, const std::function<void(int)>& job) {
    double best = 1e30;
    for (int run = 0; run < 7; ++run) {
        const auto begin = std::chrono::steady_clock::now();
        pool.run(jobs, job);
        best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    }
    return rays / best;
}

double rays_of(const std::vector<Packet>& packets) {
    double rays = 0.0;
    for (const Packet& packet : packets) rays += std::popcount(packet.active);
    return rays;
}

// A row of packets is a job.
constexpr std::size_t kPerJob = 64;
double rate(Pool& pool, const std::vector<Packet>& packets, const std::function<void(const Packet&)>& trace) {
    return rate(pool, static_cast<int>((packets.size() + kPerJob - 1) / kPerJob), rays_of(packets), [&](int job) {
        const std::size_t first = static_cast<std::size_t>(job) * kPerJob;
        for (std::size_t i = first; i < std::min(packets.size(), first + kPerJob); ++i) trace(packets[i]);
    });
}

// A ray for each lit block of 2 × 2 pixels, sixteen blocks a packet (server/shade/direct.cpp).
std::vector<Packet> shadow_packets(const CpuPicture& picture) {
    const shade::Surfaces& s = picture.surfaces;
    const glm::vec3 light = picture.geometry.local(picture.light.position);
    std::vector<Packet> packets;
    for (int top = 0; top < s.height; top += 8) {
        for (int left = 0; left < s.width; left += 8) {
            Packet packet;
            int count = 0;
            for (int i = 0; i < trace::kPacket; ++i) {
                const int x = left + i % 4 * 2, y = top + i / 4 * 2;
                if (x >= s.width || y >= s.height) continue;
                const std::size_t at = static_cast<std::size_t>(y) * s.row_length + static_cast<std::size_t>(x);
                if (!(picture.lux_per_cd[at] > 0.0f)) continue;
                const glm::vec3 from(picture.from[0][at], picture.from[1][at], picture.from[2][at]);
                trace::RayPacket& rays = packet.rays;
                rays.from_x[count] = from.x, rays.from_y[count] = from.y, rays.from_z[count] = from.z;
                rays.along_x[count] = light.x - from.x, rays.along_y[count] = light.y - from.y,
                rays.along_z[count] = light.z - from.z;
                rays.far[count++] = 1.0f - 1e-5f;
            }
            packet.active = (1u << count) - 1u;
            if (count > 0) packets.push_back(packet);
        }
    }
    return packets;
}

// Sixteen nodes off their surfaces and what each of the VPLs they ask brings.
struct Asking {
    shade::PointPacket points;
    unsigned active = 0;
    std::span<const shade::Vpl> vpls;
    std::vector<float> brings;
};
std::vector<Asking> askings(const CpuPicture& picture) {
    const glm::vec3 light(picture.light.position - picture.geometry.origin());
    std::vector<Asking> all;
    for (int number = 0; number < shade::asking_nodes(picture.grid); ++number) {
        const auto [patch, vpls] = shade::asking_nodes_at(picture.grid, picture.vpls, number);
        if (patch.active == 0) continue;
        Asking one{patch.points.off(picture.geometry), patch.active, vpls, {}};
        one.brings.resize(vpls.size() * shade::kLanes);
        shade::terms(one.points.points(), light, vpls, picture.grid.quality.kappa, one.brings.data());
        all.push_back(std::move(one));
    }
    return all;
}

double rays_of(const std::vector<Asking>& nodes) {
    double rays = 0.0;
    for (const Asking& node : nodes) {
        for (std::size_t i = 0; i < node.brings.size(); ++i)
            rays += node.brings[i] > 0.0f && (node.active >> i % shade::kLanes & 1u) != 0 ? 1.0 : 0.0;
    }
    return rays;
}

std::vector<Packet> short_packets(const CpuPicture& picture) {
    const shade::Grid& grid = picture.grid.grid;
    const float far = shade::near_reach(picture.vpls, picture.grid.quality.kappa);
    std::vector<Packet> packets;
    for (int y = 0; y < grid.height; y += shade::Patch::kSide) {
        for (int x = 0; x < grid.width; x += shade::Patch::kSide) {
            const shade::Patch patch = shade::patch_at(grid, x, y);
            if (patch.active == 0) continue;
            Packet packet;
            packet.active = patch.active;
            const shade::PointPacket from = patch.points.off(picture.geometry);
            for (int i = 0; i < trace::kPacket; ++i) {
                trace::RayPacket& rays = packet.rays;
                rays.from_x[i] = from.array[0][i], rays.from_y[i] = from.array[1][i], rays.from_z[i] = from.array[2][i];
                const glm::vec3 along = trace::around({from.array[3][i], from.array[4][i], from.array[5][i]},
                                                      picture.grid.near_directions[static_cast<std::size_t>(i)]);
                rays.along_x[i] = along.x, rays.along_y[i] = along.y, rays.along_z[i] = along.z;
                rays.far[i] = far;
            }
            packets.push_back(packet);
        }
    }
    return packets;
}

}  // namespace

RayRates measure_rays(const std::string& scene) {
    CpuPicture picture(scene_of(bench_asset(scene)));
    const trace::Geometry& geometry = picture.geometry;
    RayRates rates;
    rates.scene = scene;
    rates.shadow_per_s = rate(picture.pool, shadow_packets(picture),
                              [&](const Packet& packet) { geometry.occluded(packet.rays, packet.active, true); });
    rates.short_per_s = rate(picture.pool, short_packets(picture), [&](const Packet& packet) {
        trace::HitPacket hits;
        geometry.closest(packet.rays, packet.active, hits);
    });
    const std::vector<Asking> nodes = askings(picture);
    const shade::LightView view = picture.light_view();
    rates.vpl_per_s = rate(picture.pool, static_cast<int>(nodes.size()), rays_of(nodes), [&](int job) {
        const Asking& node = nodes[static_cast<std::size_t>(job)];
        shade::VplQuery query(node.points, node.active);
        for (std::size_t v = 0; v < node.vpls.size(); ++v)
            query.ask(view, node.vpls[v], &node.brings[v * shade::kLanes]);
    });
    return rates;
}

std::size_t vpl_rays_of(const CpuPicture& picture) {
    return static_cast<std::size_t>(rays_of(askings(picture)));
}

}  // namespace gonio::bench
