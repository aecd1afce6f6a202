// A photometric web as the storage buffer that shaders/lib/web_buffer.glsl reads.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "server/scene/direction_table.h"

namespace gonio {

// Result: the buffer's words: header of four uint32, then floats (v angles, h angles, first-cell tables, I / peak_cd).
// A dark web gives zeros.
std::vector<std::uint32_t> pack_web(const ies::PhotometricWeb& web, double peak_cd);
// Such a buffer as kernels read it.
struct PackedWeb {
    const std::uint32_t* words;
    bool symmetric;       // the same in all directions around its axis
    bool even_v, even_h;  // its angles are equally spaced, within 1e-6 rad
};
// Result: of a buffer that outlives it.
PackedWeb web_of(const std::uint32_t* words);

// Result: whether both axes are equally spaced to 1e-6 of a step: the shader then computes the cell (UNIFORM_WEB).
bool uniform_grid(const ies::PhotometricWeb& web);

// Result: bit f set for every cube face (+X -X +Y -Y +Z -Z, world axes) into which a web with these directions emits at
// all. Conservative: a face that a lit cell touches is in.
unsigned reached_faces(std::span<const glm::vec3> lit_directions, const glm::mat3& world_from_light);

// Result: face size of the IES light mask: a power of two in 64..1024 with two texels to the web's finest step.
int mask_face_size(const ies::PhotometricWeb& web);

}  // namespace gonio
