// Values of a mesh that are no numbers, NaN or infinite: what they spoil is mended or left out, and the rest stays.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "server/assets/gltf_import.h"

namespace gonio {

// Result: by vertex, whether a triangle has it.
std::vector<bool> vertices_used(const Mesh& mesh);
// values: so many components of each vertex. Those that are no numbers become `instead`. Result: whether a triangle has
// one of them.
bool mend_values(std::vector<float>& values, std::size_t components, const Mesh& mesh, float instead);
// Leaves out triangles whose positions are no numbers, and sets texture coordinates that are none to 0; warnings say
// so.
void mend_vertices(GltfImport& import, Mesh& mesh, const std::string& where);
// Normals that are no numbers get length 0. Result: whether there were any.
bool mend_normals(Mesh& mesh);

}  // namespace gonio
