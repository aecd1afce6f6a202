// From surfels (server/transport) to the points of a picture's grid: while the camera moves, irradiance of the surfels
// around each point; when it rests, links of the point's own, as a final gather. Neither depends on light.
#pragma once

#include <bit>
#include <cstdint>
#include <functional>
#include <vector>

#include "server/shade/looks.h"
#include "server/shade/raster.h"
#include "server/shade/screen.h"
#include "server/transport/transport.h"

namespace gonio::shade {

inline constexpr std::size_t kMostGenerations = 16, kLeastGenerations = 8;

// How a grid's points see the surfels. Arrays are in the shape of ScreenGrid::grid, its second points with it.
struct GridLinks {
    std::vector<const std::uint16_t*> around;  // the surfels that a point's irradiance is taken from, or null
    std::vector<float> weights;                // kNeighbours a point, of sum 1
    // Links of the points' own, a generation of kPacket each. Points without a surface have none.
    std::vector<std::vector<std::uint16_t>> generations;
    std::vector<float> nearness;  // a point's mean of min(1, spacing of surfels / length) over its first generation
    std::size_t next = 0;         // point of the generation in work: all before it have theirs
    // Generations that are shown: fewer are noisier than the surfels around; then 8 and 16.
    std::size_t shown() const {
        const std::size_t complete = generations.size() - (next > 0 ? 1 : 0);
        return complete < kLeastGenerations ? complete * (most < kLeastGenerations ? 1 : 0) : std::bit_floor(complete);
    }
    std::size_t most = kMostGenerations;  // that there shall be
};
// Fills in `around` and `weights` and forgets all links. raster: of these surfaces; null: drawn by GL.
void find_surfels(const Surfaces& surfaces, const Raster* raster, const Looks& looks, const ScreenGrid& screen,
                  const transport::Transport& transport, GridLinks& links, Pool& pool);

// Traces a part of the next generation of the points' links, some milliseconds. Result: whether one is complete now.
bool trace_grid_links(const ScreenGrid& screen, const transport::Transport& transport, GridLinks& links, Pool& pool);

// Irradiance at the surfels and what it makes them send (transport::radiosity).
struct SurfelLight {
    std::span<const glm::vec4> indirect;
    std::span<const glm::vec4>
        first;                        // of it, what points take from the surfels around them even where they have links
    float share = 0.0f;               // of their own: few links would meet where it comes from; `sent` is without it
    std::span<const glm::vec4> sent;  // empty: all comes from the surfels around
};
// Result: irradiance at every point, 3 planes in the shape of the grid.
Planes irradiance_at_grid(const ScreenGrid& screen, const transport::Transport& transport, const GridLinks& links,
                          const SurfelLight& light, Pool& pool);

}  // namespace gonio::shade
