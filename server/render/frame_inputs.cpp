#include "server/render/frame_inputs.h"

#include <algorithm>

#include "server/scene/apply.h"
#include "server/scene/false_color.h"
#include "server/scene/scene.h"

namespace gonio {

bool FrameInputs::shades_on_cpu() const {
    return direct_by_rays && scene.technique == Technique::standard && target.kind == TargetKind::live &&
           meter == Meter::none;
}

bool FrameInputs::gathers_by_gl() const {
    return !direct_by_rays && scene.technique == Technique::standard && target.kind == TargetKind::live &&
           meter == Meter::none;
}

std::uint64_t FrameInputs::surface() const {
    return transport != nullptr ? transport->surface->number : 0;
}

std::uint64_t FrameInputs::solve_links() const {
    return target.kind == TargetKind::live ? kQualityLevels[quality_level].links : kQualityLevels[0].links;
}

glm::dvec3 PassContext::weight_in_sum(const Light& light, int layer) const {
    if (layer < 0) return own_weight(light);
    if (in_sum == nullptr) return glm::dvec3(0.0);
    const auto own = in_sum->find(light.id);
    return own != in_sum->end() ? own->second : glm::dvec3(0.0);
}

glm::dvec3 PassContext::layer_weight(const Light& light) const {
    if (light.sun && scene.technique != Technique::standard) return glm::dvec3(0.0);  // that technique has none
    return light_weight(scene, light) - scene.master_ratio * weight_in_sum(light, 0);
}

namespace {

std::vector<std::uint64_t> direct_key(const FrameInputs& in, const Light& light) {
    return {light.position_rev,  light.aim_rev,   light.profile_rev, in.scene.geometry_rev,
            in.scene.camera_rev, in.bodies_stand, in.quality_level};
}

}  // namespace

bool FrameInputs::wants_each_pixel(const Light& light) const {
    return pass_cache.holds({Slot::each_pixel, target.id, light.id}, direct_key(*this, light));
}

void FrameInputs::want_each_pixel(const Light& light) const {
    pass_cache.hold({Slot::each_pixel, target.id, light.id}, direct_key(*this, light));
}

bool FrameInputs::has_besides() const {
    return scene.technique == Technique::standard && ((geometry.emissive() && !scene.emission_hidden) ||
                                                      layered() < scene.lights.size() || (merged && gathers_by_gl()));
}

PassContext FrameInputs::context() const {
    PassContext context = *this;
    context.layers_on_cpu = shades_on_cpu();
    context.gathers = gathers_by_gl();
    context.besides = has_besides();
    if (meter != Meter::none) context.bodies = nullptr, context.bodies_stand = 0;
    context.openings = meter == Meter::none && scene.technique == Technique::standard && openings_in_view(scene, eye);
    return context;
}

bool FrameInputs::can_merge() const {
    if (shows_difference(scene, view)) return false;  // each light has a sign of its own
    return (shades_on_cpu() ? view <= View::indirect : gathers_by_gl() && view < View::mask) && layered() > 1;
}

std::size_t FrameInputs::layered() const {
    return layers.size() - std::count(layers.begin(), layers.end(), -1);
}

}  // namespace gonio
