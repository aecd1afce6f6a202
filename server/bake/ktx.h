// KTX 2.0 files of one picture of shared exponents (VK_FORMAT_E5B9G9R9_UFLOAT_PACK32).
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include <glm/glm.hpp>

namespace gonio::bake {

// Result: the three values, 0 to 65,408, in 32 bits: red lowest, the exponent highest. Each is within 2⁻⁹ of the
// greatest of them (EXT_texture_shared_exponent).
std::uint32_t pack_rgb9e5(const glm::vec3& rgb);
glm::vec3 unpack_rgb9e5(std::uint32_t bits);

// picture: three values for each pixel, rows from the top, times `scale` what they stand for. Result: the file's bytes.
std::string ktx2_rgb9e5(std::span<const float> picture, int width, int height, float scale);

}  // namespace gonio::bake
