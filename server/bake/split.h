// Sheets cut where something stands on them. Neighbouring texels that do not see each other are never side by side in a
// map, so that filtering carries no light through a wall. Any thread. No files.
#pragma once

#include <vector>

#include "server/bake/atlas.h"

namespace gonio::bake {

// A stretch that two parts of a cut sheet share, where nothing stands on it: texels of each part's sheet.
struct CutSeam {
    int part[2] = {0, 0};
    glm::dvec2 from[2], to[2];
};

struct Parts {
    std::vector<Sheet> sheets;  // one: the sheet was not cut
    std::vector<CutSeam> seams;
};

// covered and texels: of the sheet, side by side. texel_m: a texel's side. A wall in the middle of a texel cuts it
// there; what is thinner than half a texel may stand between sample points unseen.
Parts split_sheet(Sheet sheet, const std::vector<Covered>& covered, const std::vector<Texel>& texels,
                  const trace::Geometry& geometry, const std::vector<char>& solids, double texel_m);

}  // namespace gonio::bake
