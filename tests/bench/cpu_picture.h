// A scene's picture as the default technique's CPU side has it before it lights it: surfaces, grid, the first
// luminaire's VPLs. No GL.
#pragma once

#include <memory>
#include <vector>

#include "server/scene/scene.h"
#include "server/shade/clusters.h"
#include "server/shade/raster.h"
#include "server/shade/screen.h"
#include "server/trace/geometry.h"

namespace gonio::bench {

struct CpuPicture {
    // At the scene's size, by the live picture's settings.
    explicit CpuPicture(const Scene& scene);
    shade::LightView light_view() const;

    Pool pool;
    trace::Geometry geometry;
    shade::Looks looks;
    shade::Clusters clusters;
    shade::Surfaces surfaces;
    shade::Raster raster;
    shade::ScreenGrid grid;
    // Of the first luminaire.
    Light light;
    std::vector<std::uint32_t> web_words;
    shade::VplRays rays;
    shade::VplCast vpls;

    // Its light on the pixels if nothing stood between, and where shadow rays from them start: surfaces.row_length a
    // row.
    std::vector<float> lux_per_cd, from[3];
};

}  // namespace gonio::bench
