#include "server/transport/crowded.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gonio::transport {

std::vector<ToCrowded> rays_to_crowded(const Transport& transport, const trace::Geometry& geometry, const Stand& from,
                                       float far) {
    // Some surfels are far larger than their spacing says. Areas are noisy, so that this must not choose those that are
    // only counted too large: what rays leave, links find, and the sum would be too small.
    constexpr float kWidths = 0.5f;  // spacings for each square root of an area; 0.68 is usual
    const Surfels& surfels = transport.surface->surfels;
    std::vector<ToCrowded> found;
    struct Part {
        std::uint32_t of;
        float form_factor;
    };
    const auto take = [&](const Part& part, const glm::vec3& passed) {
        found[part.of].form_factor += part.form_factor * trace::luminous(passed);
    };
    trace::ShadowRays<Part, decltype(take)> rays(geometry, take);
    for (const auto& [i, points] : surfels.all_crowded) {
        const glm::vec3 along = surfels.position(i) - from.p, &normal = surfels.geometric[i];
        const float m2 = transport.met_m2[i], length_m = glm::length(along), facing = glm::dot(along, from.n),
                    turned = -glm::dot(along, normal),
                    far_m = far * std::max(surfels.spacing_m[i], kWidths * std::sqrt(m2));
        if (length_m < far_m || facing <= 0.0f || turned <= 0.0f) continue;
        const float form_factor = m2 * facing * turned / (std::numbers::pi_v<float> * std::pow(length_m, 4.0f));
        found.push_back({i, 0.0f, length_m});
        for (std::size_t k = 0; k < kCellPoints; ++k) {
            const glm::vec3& to = points.at[k];
            if (points.share[k] > 0.0f)
                rays.add(from.start, to + normal * (4.0f * geometry.step_off(to)) - from.start, 1.0f,
                         {static_cast<std::uint32_t>(found.size() - 1), form_factor * points.share[k]});
        }
    }
    rays.send();
    return found;
}

}  // namespace gonio::transport
