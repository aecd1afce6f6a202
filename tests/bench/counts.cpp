#include "tests/bench/counts.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "tests/bench/ray_rates.h"

namespace gonio::bench {
namespace {

constexpr int kStripRows = 16, kStep = static_cast<int>(shade::kLanes);

// What RasterTriangle (server/shade/raster.cpp) walks over of one triangle in one strip.
void count_triangle(const shade::Setup& s, int first_row, int last_row, PictureCounts& counts) {
    for (int y = std::max<int>(s.y0, first_row); y <= std::min<int>(s.y1, last_row); ++y) {
        ++counts.rows;
        int x0 = s.x0, x1 = s.x1;
        if (x1 - x0 > 2 * kStep) {
            ++counts.wide_rows;
            float enter = 0.0f, leave = static_cast<float>(x1 - x0);
            for (const auto& edge : s.edge) {
                const float row = edge[1] * static_cast<float>(y - s.y0) + edge[2];
                if (edge[0] == 0.0f) {
                    if (row < 0.0f) leave = -2.0f;
                } else if (edge[0] > 0.0f) {
                    enter = std::max(enter, -row / edge[0] - 1.0f);
                } else {
                    leave = std::min(leave, -row / edge[0] + 1.0f);
                }
            }
            if (!(enter <= leave)) continue;
            x1 = s.x0 + static_cast<int>(leave);
            x0 += static_cast<int>(enter);
        }
        if (x1 >= x0) counts.covered += static_cast<std::size_t>((x1 / kStep - x0 / kStep + 1) * kStep);
    }
}

void count_raster(const CpuPicture& picture, PictureCounts& counts) {
    const int height = picture.surfaces.height, strips = (height + kStripRows - 1) / kStripRows;
    std::vector<bool> drawn(picture.looks.triangles.size());
    for (std::size_t bin = 0; bin < picture.raster.bins.size(); ++bin) {
        const int first = static_cast<int>(bin) % strips * kStripRows;
        for (const std::uint32_t t : picture.raster.bins[bin]) {
            drawn[t] = true;
            count_triangle(picture.raster.setups[t], first, std::min(first + kStripRows, height) - 1, counts);
        }
    }
    counts.drawn = static_cast<std::size_t>(std::count(drawn.begin(), drawn.end(), true));
    for (const shade::Cluster& cluster : picture.clusters.clusters) {
        const auto first = picture.clusters.triangles.begin() + cluster.first_triangle;
        if (std::none_of(first, first + cluster.triangles, [&](const auto& t) { return drawn[t.look]; })) continue;
        counts.vertices += (cluster.vertices + shade::kLanes - 1) / shade::kLanes * shade::kLanes;
        counts.triangles += cluster.triangles;
    }
}

void count_pixels(const CpuPicture& picture, PictureCounts& counts) {
    const shade::Surfaces& s = picture.surfaces;
    counts.pixels = s.depth.size();
    for (std::size_t at = 0; at < counts.pixels; at += shade::kLanes) {
        const auto textured = [&](std::size_t pixel) {
            const std::uint32_t nearest = picture.raster.nearest[pixel];
            if (nearest == 0) return false;
            return picture.looks.materials[picture.looks.triangles[nearest - 1].material].image >= 0;
        };
        bool any = false;
        for (std::size_t i = at; i < at + shade::kLanes; ++i) any = any || textured(i);
        if (any) counts.textured += shade::kLanes;
    }
    for (int y = 0; y + 1 < s.height; y += 2) {
        for (int x = 0; x + 1 < s.width; x += 2) {
            const std::size_t at = static_cast<std::size_t>(y) * s.row_length + static_cast<std::size_t>(x);
            const auto lit = [&](std::size_t i) { return picture.lux_per_cd[i] > 0.0f; };
            ++counts.blocks;
            if (lit(at) && lit(at + 1) && lit(at + s.row_length) && lit(at + s.row_length + 1)) ++counts.lit_blocks;
        }
    }
}

}  // namespace

PictureCounts count_picture(const std::string& name, const Scene& scene) {
    CpuPicture picture(scene);
    PictureCounts counts;
    counts.scene = name;
    count_raster(picture, counts);
    count_pixels(picture, counts);
    const auto shown = [](const shade::Grid& grid) {
        std::size_t count = 0;
        for (int y = 0; y < grid.height; ++y) {
            for (int x = 0; x < grid.width; ++x)
                count += grid.values[6][static_cast<std::size_t>(grid.at(x, y))] > 0.0f ? 1u : 0u;
        }
        return count;
    };
    counts.points = shown(picture.grid.grid);
    counts.nodes = shown(picture.grid.nodes);
    for (const shade::Patch& packet : picture.grid.second_packets)
        counts.second_points += static_cast<std::size_t>(std::popcount(packet.active));
    counts.vpl_rays = vpl_rays_of(picture);
    counts.emissive = std::any_of(scene.asset->materials.begin(), scene.asset->materials.end(),
                                  [](const Material& m) { return m.emissive_nit != glm::vec3(0.0f); });
    const shade::Web web = shade::web_of(picture.web_words.data());
    counts.web_symmetric = web.symmetric;
    counts.web_even = web.even_v && (web.symmetric || web.even_h);
    return counts;
}

}  // namespace gonio::bench
