#include "server/render/rsm_texels.h"

#include <algorithm>
#include <numbers>

#include "shaders/lib/as_cpp.h"

namespace gonio {

glm::dvec3 RsmTexels::position(std::size_t texel) const {
    const auto n = static_cast<std::size_t>(size);
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

glm::dvec3 dense_irradiance(const RsmTexels& rsm, const glm::dvec3& point, const glm::dvec3& normal) {
    glm::dvec3 sum(0.0);
    for (std::size_t texel = 0; texel < rsm.flux.size(); ++texel) {
        const glm::vec4& flux = rsm.flux[texel];
        if (flux.r <= 0.0f && flux.g <= 0.0f && flux.b <= 0.0f) continue;
        const double geometry = glsl64::vpl_geometry(point - rsm.position(texel), rsm.normal_of(texel), normal,
                                                     static_cast<double>(flux.a));
        sum += glm::dvec3(flux) * (geometry / std::numbers::pi);
    }
    return sum;
}

}  // namespace gonio
