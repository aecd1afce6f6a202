#include "tests/bench/ray_rates.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <functional>
#include <vector>

#include "server/lighting/direct.h"
#include "server/lighting/raster.h"
#include "server/render/passes/passes.h"
#include "server/scene/apply.h"
#include "server/scene/light_tables.h"
#include "server/scene/scene.h"
#include "server/transport/links.h"
#include "tests/bench/cases.h"

namespace gonio::bench {
namespace {

// Result: `rays` over the seconds that the work takes, the best of several runs.
double rate(double rays, const std::function<void()>& work) {
    double best = 1e30;
    for (int run = 0; run < 7; ++run) {
        const auto begin = std::chrono::steady_clock::now();
        work();
        best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    }
    return rays / best;
}

// A ray for each lit point of the grid, sixteen points a packet (server/lighting/direct.cpp).
std::vector<transport::Fan> shadow_packets(const Scene& scene, const trace::Geometry& geometry, Pool& pool) {
    const lighting::MaterialTable looks = lighting::make_material_table(geometry);
    lighting::GBuffer s;
    lighting::Raster raster;
    lighting::look_through(eye_of(scene.camera, scene.width_px, scene.height_px), geometry, 2e-5f * geometry.extent(),
                           scene.width_px, scene.height_px, s);
    lighting::draw_gbuffer(lighting::make_clusters(geometry), looks, false, s, raster, pool);
    const Light& light = scene.lights.at(0);
    const lighting::DirectLight direct{geometry.local(light.position), light_from_world(light),
                                       web_of(tables_of(*light.profile).words.data()), 1.0f};
    std::vector<float> points[6], lux_per_cd(s.depth.size());
    for (std::vector<float>& values : points) values.resize(s.depth.size());
    for (int y = 0; y < s.height; ++y) {
        for (int x = 0; x < s.width; ++x) {
            const lighting::Spot spot = lighting::spot_at(s, x, y);
            for (int k = 0; k < 3; ++k) {
                const std::size_t at = static_cast<std::size_t>(y) * s.row_length + static_cast<std::size_t>(x);
                points[k][at] = spot.position[k], points[k + 3][at] = spot.normal[k];
            }
        }
    }
    lighting::direct_points(direct, lighting::points_at(points, 0), lux_per_cd.size(), lux_per_cd.data());
    std::vector<transport::Fan> packets;
    for (int top = 0; top < s.height; top += 16) {
        for (int left = 0; left < s.width; left += 16) {
            transport::Fan packet;
            int count = 0;
            for (int i = 0; i < trace::kPacket; ++i) {
                const int x = left + i % 4 * 4 + 2, y = top + i / 4 * 4 + 2;
                if (x >= s.width || y >= s.height) continue;
                const std::size_t at = static_cast<std::size_t>(y) * s.row_length + static_cast<std::size_t>(x);
                if (!(lux_per_cd[at] > 0.0f)) continue;
                const lighting::Spot spot = lighting::spot_at(s, x, y);
                const float off_m = 4.0f * geometry.step_off(direct.position) + 0.02f * s.depth_per_pixel * spot.depth;
                const glm::vec3 start = spot.position + spot.normal * off_m, along = direct.position - start;
                packet.rays.set(count++, start, along, 1.0f - 1e-5f);
            }
            packet.active = (1u << count) - 1u;
            if (count > 0) packets.push_back(packet);
        }
    }
    return packets;
}

}  // namespace

RayRates measure_rays(const std::string& name) {
    const Scene scene = scene_of(bench_asset(name));
    const trace::Geometry geometry(scene.asset);
    Pool pool;
    RayRates rates;
    rates.scene = name;
    const std::vector<transport::Fan> packets = shadow_packets(scene, geometry, pool);
    double rays = 0.0;
    for (const transport::Fan& packet : packets) rays += std::popcount(packet.active);
    rates.shadow_per_s = rate(rays, [&] {
        pool.run_chunks(packets.size(), 64, [&](std::size_t first, std::size_t count) {
            for (std::size_t i = first; i < first + count; ++i)
                geometry.occluded(packets[i].rays, packets[i].active, true);
        });
    });
    const glm::vec3 seeds[] = {geometry.local(scene.camera.eye), geometry.local(scene.lights.at(0).position)};
    const auto go_on = [] { return false; };
    const transport::Surfels surfels = transport::place_surfels(geometry, seeds, std::size(seeds), {}, pool, go_on);
    const transport::CellMap cells(geometry, surfels, transport::SurfelSettings{}.bytes / 4);  // the first run fills it
    rates.link_per_s = rate(static_cast<double>(surfels.count) * trace::kPacket,
                            [&] { transport::trace_links(geometry, surfels, cells, 0, trace::kPacket, pool, go_on); });
    return rates;
}

}  // namespace gonio::bench
