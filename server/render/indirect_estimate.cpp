#include "server/render/indirect_estimate.h"

#include <algorithm>
#include <numbers>

#include "shaders/lib/as_cpp.h"

namespace gonio {
namespace {

bool lit(const glm::vec4& flux) {
    return flux.r > 0.0f || flux.g > 0.0f || flux.b > 0.0f;
}

}  // namespace

std::array<glm::dvec3, 2> checkerboard_irradiance(const RsmTexels& rsm, const glm::dvec3& point,
                                                  const glm::dvec3& normal) {
    std::array<glm::dvec3, 2> sums{};
    const auto side = static_cast<std::size_t>(std::max(rsm.size, 1));
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
