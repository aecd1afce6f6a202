// The CPU's side of one target of the default technique, by the pass that writes it. The pipeline hands each pass its
// parts. Render thread.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "server/lighting/air_picture.h"
#include "server/lighting/antialias.h"
#include "server/lighting/direct.h"
#include "server/lighting/final_gather.h"
#include "server/lighting/glow.h"
#include "server/lighting/grid_light.h"
#include "server/lighting/layers.h"
#include "server/lighting/opening_pixels.h"
#include "server/lighting/raster.h"
#include "server/render/light_gpu.h"
#include "server/render/target.h"
#include "server/transport/crowded.h"

namespace gonio {

// What the pixels show: of run_raster or run_grid.
struct Surfaces {
    lighting::GBuffer gbuffer;
    lighting::ScreenGrid grid;
    lighting::Raster raster;  // where the G-buffer is read from GL, the colours only
    lighting::Edges edges;    // where shows_edges()
    std::size_t grid_size() const { return grid.grid.size() + lighting::kSimdWidth; }
};

// Of no pass: what is in it is lost with the next.
struct Scratch {
    std::vector<std::uint16_t> halves;  // what is uploaded
    lighting::Planes direct, grid;
    lighting::Lattice lattice;  // what of the direct light is asked at the grid
};

// Luminaires' own light, where it stays on the CPU: of run_direct_rays, run_gather and the final gather.
struct Layers {
    std::vector<lighting::LightLayer> all;
    lighting::LightLayer& at(int layer) {
        all.resize(std::max(all.size(), static_cast<std::size_t>(layer) + 1));
        return all[static_cast<std::size_t>(layer)];
    }
};

// Luminaires at their weights as one.
struct Merged {
    // Of run_merge.
    std::vector<lighting::DirectLight> lights;  // those with weight
    float reference = 0.0f;  // the greatest weight, cd: what their light is measured per; 0: all are dark
    // Of run_merge, its direct part, and run_solve_merged, in that unit.
    transport::Irradiance irradiance;
    bool moves = false;  // it has changed since it was solved
    // Of run_direct_merged and run_gather_merged, per cd of the reference × the layers' unit: 4 per pixel; planes of
    // the grid.
    std::vector<std::uint16_t> direct;
    lighting::Planes indirect;
};

// Light without a layer: direct, and after bounces. Of run_gather_emitted, or of the passes of summed luminaires; the
// second, where a picture rests, of the final gather.
struct Besides {
    std::array<std::vector<std::uint16_t>, 2> pixels;  // 4 per pixel, × unit_lx
    std::array<std::vector<float>, 2> precise;         // instead, where a precise target has more than half floats
    std::array<float, 2> unit_lx{};                    // 0: there is none
};

// All light at the pixels.
struct PixelLight {
    Layers layers;
    Merged merged;                                 // of luminaires with layers while those are old
    Merged summed_list;                            // of the others
    Besides emitted, summed;                       // of emissive surfaces; of the others at the master's full level
    std::vector<lighting::OpeningPixel> openings;  // of run_openings, where Slot::openings is shown
};

// The final gather of a live picture that is at work (Slot::gathering).
struct Gathering {
    std::unique_ptr<lighting::FinalGather> work;
    std::vector<std::vector<std::uint16_t>> pixels;   // by source, as of LightLayer::gathered
    std::vector<std::shared_ptr<const WebGpu>> webs;  // that `work` reads
};

// Of run_composite_cpu.
struct Composed {
    lighting::LayerSum sum;
    lighting::Planes grid;  // Slot::grid_sum: 3 planes in the shape of the grid, the sum of luminaires' indirect light
    std::shared_ptr<std::vector<std::uint8_t>> nv12;                   // since it was taken; null where shaders make it
    std::vector<std::uint16_t> work_light;                             // 4 half floats a pixel: cosine to the camera
    std::vector<std::uint8_t> unfiltered;                              // scratch of filter_edges()
    std::vector<std::shared_ptr<std::vector<std::uint8_t>>> pictures;  // made before; those nobody holds are used again
};

// What shaders gather from: of run_gather_weights_gl.
struct OnGpu {
    std::shared_ptr<const transport::Transport::Surface> surface;
    std::shared_ptr<const transport::CellMap::Table> cells;
    gl::Buffer surfels, around, triangle_buffer, cell_buffer;
    bool bodies = false;  // `around` goes on with their parts
};

// Surfaces::edges as the composite's shader reads them; albedo and emission in place of the target's.
struct EdgesOnGpu {
    std::uint64_t version = 0;  // of Slot::edges; 0: never made
    gl::Buffer rows, pixels, taps;
    gl::Texture albedo, emission;
};

// Of a meter's passes: direct, and after bounces.
struct MeterLight {
    struct Direct {
        glm::dvec3 light{0.0}, error{0.0};
    };
    std::vector<Direct> direct;                 // per candela of peak, rgb, 1/m², by layer
    std::vector<PointLight> layers;             // after bounces, per candela of peak, by layer
    std::array<PointLight, 2> emitted, summed;  // lux
    std::vector<std::uint16_t> ids;             // of its links, the same for all light
    std::vector<float> passed;                  // by link: what air that absorbs lets arrive
    lighting::LinkEnds ends;
    std::vector<transport::ToCrowded> rays;
};

// Of the passes of haze, along the rays of the view or at its probes. Units: as of the light that is scattered.
struct ScreenAir {
    lighting::AirView view;
    std::vector<std::uint8_t> seen_probes;  // of PassContext::probes, by the view's eye
    std::vector<lighting::Beam> beams;      // by layer: of a luminaire
    lighting::Planes summed_beams;          // rgb, of luminaires without a layer, cd/m² at the master's full level
    struct SummedNear {
        lighting::NearAir air;
        glm::vec3 weight;
    };
    std::vector<SummedNear> summed_near;  // of the same luminaires
    std::vector<lighting::Glow> glow;     // by layer: of the light of surfaces
    lighting::Glow merged_glow, summed_glow, emitted_glow;
    lighting::AirPicture picture;  // Slot::air_picture
    gl::Texture texture;           // the same, RGBA16F, where shaders composite
};

struct ScreenLight {
    Surfaces surfaces;
    lighting::GridWeights weights;  // of run_gather_weights
    Scratch scratch;
    PixelLight light;
    Gathering gathering;
    Composed composed;
    OnGpu on_gpu;
    lighting::EdgeSamples edge_samples;  // of continue_antialias (Slot::edge_samples)
    EdgesOnGpu edges_on_gpu;
    std::array<float, 2> besides_unit_lx{};  // of Target::besides: of run_besides
    MeterLight meter;
    ScreenAir air;
    transport::Solved solved;  // of the last solve in this run of the passes; none: no bounces
};

}  // namespace gonio
