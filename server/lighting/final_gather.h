// Indirect light at the pixels of a picture that rests: a final gather along links of each pixel's own.
// The links are interleaved over some pixels (Keller and Heidrich 2001, "Interleaved Sampling"). Where nothing is near,
// the gather is averaged over these pixels.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "server/lighting/screen.h"
#include "server/lighting/surfel_light.h"
#include "server/transport/transport.h"

namespace gonio::lighting {

struct GatherPass {
    unsigned generations;  // of trace::kPacket links of each pixel
    int tile;              // 4 or 8: as many pixels square follow different ones and share them
};
// Of a live picture one after the other; a pass shows when it is complete.
inline constexpr GatherPass kLivePasses[] = {{1, 8}, {4, 4}};
inline constexpr GatherPass kStillPass{2, 8}, kPrecisePass{4, 4};

// Light that is gathered: of one luminaire, or of emissive surfaces.
struct GatherSource {
    transport::Table sent;          // by the surfels (transport::radiosity)
    std::vector<glm::vec4> direct;  // what `ends` refers to
    std::optional<EndLight> ends;
    Planes besides;  // irradiance that is added, in the shape of the grid; empty: none
};
// Of more luminaires than these, no link takes direct light of its own: a shadow ray for each would be too many.
inline constexpr std::size_t kMostExactLights = 8;

// A pass over one picture, as far as it has come.
struct FinalGather {
    GatherPass pass;
    std::vector<GatherSource> sources;
    int next = 0;            // row to be traced
    std::size_t next_x = 0;  // from here on
    struct Row {
        std::vector<Spot> spots;
        std::vector<float> near;                  // 0: averaged over the tile; 1: the pixel's own alone
        std::vector<std::vector<glm::vec4>> own;  // by source
    };
    std::vector<Row> rows;                             // the newest
    std::vector<transport::FanDirections> directions;  // of the links, by generation and part of the tile
};

// Traces a part of the next row, some milliseconds. done(source, y, values): called for each complete row y, rgb
// irradiance by pixel, on the caller's thread. Result: whether all are. Render thread.
bool continue_gather(const GBuffer& gbuffer, const ScreenGrid& screen, const transport::Transport& transport,
                     FinalGather& gather, const std::function<void(std::size_t, int, std::span<const glm::vec4>)>& done,
                     Pool& pool);

}  // namespace gonio::lighting
