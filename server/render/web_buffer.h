// A photometric web as the storage buffer that shaders/lib/web_buffer.glsl reads.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "ies/web.h"
#include "server/shade/kernels.h"

namespace gonio {

// Result: the buffer's words: header of four uint32, then floats (v angles, h angles, first-cell tables, I / I_peak).
// A dark web gives zeros.
std::vector<std::uint32_t> pack_web(const ies::PhotometricWeb& web);
// Result: how kernels read such a buffer, which outlives it.
shade::Web web_of(const std::uint32_t* words);

// Result: whether both axes are equally spaced to 1e-6 of a step: the shader then computes the cell (UNIFORM_WEB).
bool uniform_grid(const ies::PhotometricWeb& web);

// Result: where the web is not dark, on the luminaire's axes, to kLitDirectionsOff: at most some 5,000 directions.
std::vector<glm::vec3> lit_directions(const ies::PhotometricWeb& web);
inline constexpr float kLitDirectionsOff = 0.1f;  // rad
// Result: bit f set for every cube face (+X -X +Y -Y +Z -Z, world axes) into which a web with these directions emits at
// all. Conservative: a face that a lit cell touches is in.
unsigned reached_faces(std::span<const glm::vec3> lit_directions, const glm::mat3& world_from_light);

// Result: cosine of the angle from photometric zero, -Z, beyond which the web is dark, or a little less: at least -1.
float beam_cosine(const ies::PhotometricWeb& web);

// Result: face size of the IES light mask: a power of two in 64..1024 with two texels to the web's finest step.
int mask_face_size(const ies::PhotometricWeb& web);

}  // namespace gonio
