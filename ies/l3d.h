// L3D, the geometry of a luminaire in GLDF: a zip archive with structure.xml. Internal to ies/; the models are not
// read.
#pragma once

#include <string>
#include <vector>

#include "ies/core/result.h"
#include "ies/photometry.h"

namespace gonio::ies::detail {

inline constexpr std::size_t kMaxL3dObjects = 1000;  // luminous openings; the rest is ignored

struct L3dObject {
    std::string name;     // partName, which GLDF calls EmitterObjectExternalName
    Opening opening;      // sizeX, across C90–C270, is its width; sizeY, along it, its length
    bool turned = false;  // about other axes than the vertical, or not by right angles: the sizes are as they stand
};

// bytes: the archive. Result: the LightEmittingObjects with their Rectangle or Circle, metres, in the order of the
// file. Errors: those of open_zip and of reading structure.xml, of XML, unknown_root, not_a_number, not_finite.
Result<std::vector<L3dObject>> read_l3d(std::string bytes);

}  // namespace gonio::ies::detail
