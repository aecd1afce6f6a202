#include "server/render/rsm_texels.h"

#include <algorithm>
#include <numbers>

#include "shaders/lib/as_cpp.h"

namespace gonio {
namespace {

bool lit(const glm::vec4& flux) {
    return flux.r > 0.0f || flux.g > 0.0f || flux.b > 0.0f;
}

}  // namespace

glm::dvec3 RsmTexels::position(std::size_t texel) const {
    const std::size_t n = size;
    const std::size_t face = texel / (n * n), y = texel / n % n, x = texel % n;
    const glm::dvec2 st((2.0 * static_cast<double>(x) + 1.0) / size - 1.0,
                        (2.0 * static_cast<double>(y) + 1.0) / size - 1.0);
    return glm::normalize(glsl64::cube_direction(static_cast<int>(face), st)) *
           static_cast<double>(radial_depth[texel]);
}

glm::dvec3 RsmTexels::normal_of(std::size_t texel) const {
    return glsl64::octahedral_decode(
        glm::dvec2(std::max(normal[2 * texel] / 32767.0, -1.0), std::max(normal[2 * texel + 1] / 32767.0, -1.0)));
}

std::array<glm::dvec3, 2> checkerboard_irradiance(const RsmTexels& rsm, const glm::dvec3& point,
                                                  const glm::dvec3& normal) {
    std::array<glm::dvec3, 2> sums{};
    const std::size_t side = std::max(rsm.size, 1);
    for (std::size_t texel = 0; texel < rsm.flux.size(); ++texel) {
        const glm::vec4& flux = rsm.flux[texel];
        if (!lit(flux)) continue;
        const double geometry = glsl64::vpl_geometry(point - rsm.position(texel), rsm.normal_of(texel), normal,
                                                     static_cast<double>(flux.a));
        sums[(texel % side + texel / side) % 2] += glm::dvec3(flux) * (geometry / std::numbers::pi);
    }
    return sums;
}

unsigned lit_texels(const RsmTexels& rsm) {
    return static_cast<unsigned>(std::count_if(rsm.flux.begin(), rsm.flux.end(), lit));
}

}  // namespace gonio
