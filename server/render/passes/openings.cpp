// Luminaires' luminous openings in the picture (server/lighting/opening_pixels.h).
#include "server/lighting/opening_pixels.h"

#include <algorithm>
#include <cmath>

#include "server/render/passes/passes.h"
#include "server/scene/apply.h"
#include "server/scene/opening.h"
#include "server/scene/opening_points.h"
#include "server/scene/scene.h"
#include "server/trace/luminous.h"

namespace gonio {

bool has_opening(const Light& light) {
    return opening_of(light).shape != ies::OpeningShape::point;
}

bool openings_in_view(const Scene& scene, const Eye& eye) {
    return std::any_of(scene.lights.begin(), scene.lights.end(), [&](const Light& light) {
        return has_opening(light) && may_see(eye, light.position, glm::length(half_sides(opening_of(light))));
    });
}

PassRun run_openings(const PassContext& context, const Surfaces& surfaces, std::vector<lighting::OpeningPixel>& seen) {
    std::vector<trace::Luminaire> luminaires;
    for (const Light& light : context.scene.lights)
        if (has_opening(light)) luminaires.push_back(trace::luminaire_of(light, context.traced));
    seen =
        lighting::see_openings(luminaires, surfaces.gbuffer, context.traced, context.bodies != nullptr, context.pool);
    return {};
}

std::vector<lighting::ShiningPixel> shown_openings(const PassContext& context, View view, const PixelLight& light) {
    if (!context.openings || !shows_openings(view)) return {};
    return lighting::weigh_openings(light.openings, [&](std::uint32_t id) {
        const auto own = std::ranges::find(context.scene.lights, id, &Light::id);
        return own != context.scene.lights.end() ? glm::vec3(light_weight(context.scene, *own)) : glm::vec3(0.0f);
    });
}

}  // namespace gonio
