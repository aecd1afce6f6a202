// Antialiasing by subpixel reconstruction (Chajdas, McGuire and Luebke 2011): surfaces are drawn at many samples a
// pixel, light is computed at one. A sample has its own reflectance, and the light of that pixel near it which shows
// the same surface. Both depend on geometry and camera alone, so that light which moves stays antialiased.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "server/base/pool.h"
#include "server/lighting/clusters.h"
#include "server/lighting/material_table.h"
#include "server/lighting/raster.h"
#include "server/lighting/screen.h"
#include "shaders/shared/layouts.h"

namespace gonio::lighting {

// Result: where sample i of n lies in its pixel, from its centre, pixels: a Hammersley set, -0.5..0.5. The box is the
// reconstruction filter, as of the reference (server/trace/reference.h).
glm::vec2 sample_offset(unsigned i, unsigned n);

// Pixels that show more than one surface. Such a pixel is own × what its centre shows + the sum of its taps.
struct Edges {
    // A pixel that stands for samples that no pixel's centre shows the like of. Its direct light is the mean of its
    // own and theirs, weighed by what they reflect.
    struct Mixed {
        std::uint32_t x, first, count;  // into points
        float albedo;                   // that its own light counts
    };
    struct Point {
        glm::vec3 position, normal;  // local, m; unit
        float depth;                 // along the view axis, m
        float albedo;
    };
    std::vector<std::uint32_t> rows;  // by row of the picture, and one more: where it begins in `pixels`
    std::vector<layouts::EdgePixel> pixels;
    std::vector<std::uint64_t> others;  // by pixel, bit i: sample i shows something else than the centre
    std::vector<layouts::EdgeTap> taps;
    std::vector<std::vector<Mixed>> mixed;  // by row
    std::vector<std::vector<Point>> points;
    // Of all pixels, as in Raster, in place of it: the mean over the samples that show what the centre does.
    std::vector<std::uint16_t> albedo;
    std::vector<float> emission;
};

// Edges in the making, sample by sample.
struct EdgeSamples {
    struct Point {  // a sample whose direct light is its own
        std::uint16_t x;
        bool in_mean;          // `albedo` has it
        std::uint32_t before;  // of its pixel, index + 1; 0: none
        Edges::Point point;    // its albedo: the sum over the samples on that surface
    };
    struct Found {                   // samples that show something else than the centre of their pixel
        std::uint16_t x = 0;         // its column
        std::int8_t dx = 0, dy = 0;  // from there to the pixel whose light they take
        bool surface = false;        // else they show the background
        std::uint8_t count = 1;
        std::uint32_t before = 0;                    // of its pixel, index + 1; 0: none
        std::uint64_t samples = 0;                   // bit i: sample i
        glm::vec3 albedo{0.0f}, emission_nit{0.0f};  // sums
    };
    unsigned done = 0;
    std::vector<std::vector<Found>> rows;
    std::vector<std::vector<Point>> points;
    std::vector<std::uint32_t> newest, newest_point;  // per pixel: of `rows` and `points`, index + 1; 0: none
    // Per pixel 4: the sum over its other samples, and their number; cd/m².
    std::vector<float> albedo, emission;
    GBuffer gbuffer;  // of one sample
    Raster raster;
};

// Raster::nearest of a pixel whose light was computed for another surface than the raster has: its samples are compared
// with the G-buffer.
inline constexpr std::uint32_t kAnotherSurface = ~0u;
// Marks such pixels of a raster: gbuffer has what is lit, drawn what the raster shows.
void mark_others(const GBuffer& gbuffer, const GBuffer& drawn, Raster& raster, Pool& pool);

// Draws sample `done` of n, at most 64, and compares it with the picture whose pixels are lit (gbuffer, raster). Of a
// pixel's samples those that take the same light are kept as one. A row keeps no more than four such a pixel; the
// others count as their pixel's centre. Result: whether that was the last. Eight parameters: a scene, a picture and the
// work; bodies, which may be null, are of the scene. Render thread.
bool add_edge_sample(const Clusters& clusters, const MaterialTable& materials, bool emissive, const GBuffer& gbuffer,
                     const Raster& raster, unsigned n, EdgeSamples& samples, Pool& pool,
                     const PosedBodies* bodies = nullptr);
// Result: of all n samples, which are gone then.
Edges edges_of(unsigned n, EdgeSamples& samples, Pool& pool);

}  // namespace gonio::lighting
