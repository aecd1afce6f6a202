// How often the kernels of a picture's passes run: what does not depend on the machine. Operations are counted from
// these (operations.h).
#pragma once

#include <string>

#include "server/scene/scene.h"

namespace gonio::bench {

// Of one picture of the default technique under its first luminaire, without refinement. Numbers of things.
struct PictureCounts {
    std::string scene;
    std::size_t vertices = 0, triangles = 0;  // of clusters of which something is drawn
    std::size_t drawn = 0;                    // triangles that are set up and put into strips of rows
    std::size_t rows = 0, wide_rows = 0;      // of triangles in strips; those whose ends are looked for
    std::size_t covered = 0;                  // pixels tested against a triangle, in steps of kLanes
    std::size_t pixels = 0;                   // shaded, whole rows of lanes
    std::size_t textured = 0;                 // of them in steps in which a pixel has a texture
    std::size_t blocks = 0, lit_blocks = 0;   // of 2 × 2 pixels; those whose pixels the luminaire all reaches
    std::size_t points = 0, nodes = 0;        // of the grid, on surfaces
    std::size_t second_points = 0;            // beside the grid
    std::size_t vpl_rays = 0;                 // of the nodes, to VPLs that could light them
    bool emissive = false;
    bool web_symmetric = false, web_even = false;
};
PictureCounts count_picture(const std::string& name, const Scene& scene);

}  // namespace gonio::bench
