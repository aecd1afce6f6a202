// The CPU's side of one target of the default technique: shared by the passes that fill it. Render thread.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "server/lighting/direct.h"
#include "server/lighting/final_gather.h"
#include "server/lighting/grid_light.h"
#include "server/lighting/layers.h"
#include "server/lighting/raster.h"
#include "server/render/light_gpu.h"
#include "server/render/passes/passes.h"
#include "server/render/target.h"

namespace gonio {

// The CPU's side of one target: what it reads of the G-buffer, and what it made of it per light.
struct ScreenLight {
    lighting::GBuffer gbuffer;
    lighting::ScreenGrid grid;
    lighting::GridWeights weights;
    std::vector<std::uint16_t> halves;  // scratch: what is uploaded
    lighting::Planes direct;            // scratch: direct light in floats
    lighting::Lattice lattice;          // and what of it is asked at the grid
    std::vector<PointLight> points;     // by layer, of meters
    struct PointLinks {                 // of a meter
        std::vector<std::uint16_t> ids;
        lighting::LinkEnds ends;
    } point_links;
    // Where layers stay on the CPU.
    std::vector<lighting::LightLayer> layers;
    std::uint64_t writes = 0;  // to them
    // Light without a layer: of emissive surfaces, and of luminaires that are summed. Each direct, and after bounces.
    struct Besides {
        std::array<std::vector<std::uint16_t>, 2> pixels;  // 4 per pixel, × unit_lx
        std::array<float, 2> unit_lx{};                    // 0: there is none
        float gain = 1.0f;                                 // of the picture: the master, where it is not in the pixels
        unsigned passes = 0;                               // of the final gather that are in the second
        std::uint64_t version = 0;                         // another one with every change
    } emitted, summed;
    std::array<float, 2> besides_unit_lx{};                 // of Target::besides, which is all of it
    std::array<PointLight, 2> emitted_point, summed_point;  // of meters, lux
    // The final gather that is at work.
    struct Gathering {
        std::unique_ptr<lighting::FinalGather> work;
        // By source: index of its luminaire, the number of them for emissive surfaces, one more for summed luminaires;
        // version of its layer when it began; what it has made.
        std::vector<std::pair<std::size_t, std::uint64_t>> wanted;
        std::vector<std::vector<std::uint16_t>> pixels;   // as of LightLayer::gathered
        std::vector<std::shared_ptr<const WebGpu>> webs;  // that `work` reads
    } gathering;
    std::uint64_t gathered = 0;  // counts passes of it that were completed
    lighting::LayerSum sum;
    lighting::Planes grid_sum;  // 3 planes in the shape of the grid: the sum of the luminaires' indirect light
    std::optional<std::uint64_t>
        summed_changes;  // LayerSum::changes() it was made from; none: scratch, or an older grid
    struct Merged {
        std::vector<lighting::DirectLight> lights;  // those with weight
        float reference = 0.0f;            // the greatest weight, cd: what their light is measured per; 0: all are dark
        transport::Irradiance irradiance;  // in that unit
        bool moves = false;                // it has changed since it was solved
        // Per cd of the reference × the layers' unit: 4 per pixel; planes of the grid.
        std::vector<std::uint16_t> direct;
        lighting::Planes indirect;
    } merged, summed_list;  // of luminaires with layers while those are old; of the others
    struct OnGpu {          // where shaders gather: what they read
        std::shared_ptr<const transport::Transport::Surface> surface;
        std::shared_ptr<const transport::CellMap::Table> cells;
        gl::Buffer surfels, around, triangle_buffer, cell_buffer;
    } on_gpu;
    lighting::Raster raster;  // of it, where the G-buffer is read from GL, the colours only
    std::shared_ptr<std::vector<std::uint8_t>> nv12;
    std::vector<std::shared_ptr<std::vector<std::uint8_t>>> pictures;  // made before; those nobody holds are used again
};

inline ScreenLight::Merged& merged_of(const Target& target, Together which) {
    return which == Together::summed ? target.screen->summed_list : target.screen->merged;
}

inline lighting::LightLayer& layer_of(ScreenLight& screen, int layer) {
    screen.layers.resize(std::max(screen.layers.size(), static_cast<std::size_t>(layer) + 1));
    return screen.layers[static_cast<std::size_t>(layer)];
}

lighting::DirectLight direct_light_of(const PassContext& context, const Light& light, const LightGpu& gpu);
// values: surfaces.row_length pixels a row.
void upload(const gl::Texture& array, const lighting::GBuffer& gbuffer, int layer, GLenum format, GLenum type,
            const void* values);

}  // namespace gonio
