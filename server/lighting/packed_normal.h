// Unit vectors as the G-buffer and the material table hold them: octahedral, 2 snorm16. simd_materials.h has it for
// SIMD lanes.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

namespace gonio::lighting {

std::uint32_t pack_normal(const glm::vec3& n);  // n: unit
glm::vec3 unpack_normal(std::uint32_t bits);    // result: unit

}  // namespace gonio::lighting
