#include "server/exchange/export_light.h"

#include <algorithm>
#include <cmath>

#include "ies/core/printed.h"
#include "ies/writers.h"
#include "server/assets/assets.h"
#include "server/scene/gel.h"
#include "server/scene/opening.h"

namespace gonio::exchange {
namespace {

// Whether both webs are the same but for rounding.
bool is_same_web(const ies::PhotometricWeb& a, const ies::PhotometricWeb& b) {
    constexpr double kRounding_rad = 1e-12;
    constexpr float kRounding = 1e-6f;
    const auto near = [](double x, double y) { return std::abs(x - y) < kRounding_rad; };
    return std::ranges::equal(a.v_rad, b.v_rad, near) && std::ranges::equal(a.h_rad, b.h_rad, near) &&
           std::ranges::equal(a.candela, b.candela, [](float x, float y) { return std::abs(x - y) < kRounding; });
}

}  // namespace

ies::Photometry photometry_of(const Light& light, double factor) {
    ies::Photometry photometry = light.shining()->photometry;
    for (float& candela : photometry.web.candela)
        candela = static_cast<float>(static_cast<double>(candela) * light.tilt_factor * factor);
    photometry.tilt.reset();
    photometry.opening = opening_of(light);
    photometry.provenance.absolute = true;
    photometry.provenance.lamps = 1;
    photometry.provenance.lumens_per_lamp = -1.0;
    return photometry;
}

Result<std::string> ies_file_of(const Light& light, double factor) {
    if (light.shining()->peak_cd * light.tilt_factor * factor > ies::kMaxCandela)
        return Error{"too_large", light.name, print_number(light.shining()->peak_cd * light.tilt_factor * factor),
                     "a light has at most 1e12 cd in a file"};
    std::string text = ies::write_lm63(photometry_of(light, factor));
    if (text.size() <= ies::kMaxFileBytes) return text;
    return Error{"too_large", light.name, std::to_string(text.size()) + " bytes",
                 "as LM-63 the light's web would be larger than any reader here takes"};
}

std::string ies_key_of(const Light& light, double factor) {
    const ies::Opening opening = opening_of(light);
    return printed("%p %.17g %d %.17g %.17g %.17g", static_cast<const void*>(light.shining().get()),
                   light.tilt_factor * factor, static_cast<int>(opening.shape), opening.width.in(m),
                   opening.length.in(m), opening.height.in(m));
}

LightScale color_of(const Light& light) {
    const glm::dvec3 weight = light.color * filtered_white(light.cct_k, light.tint_duv, light.gel.get());
    const double most = std::max({weight.r, weight.g, weight.b});
    return most > 0.0 ? LightScale{most, weight / most} : LightScale{};
}

double shown_level(const Light& light, double master_ratio) {
    return light.level_ratio * light.shutter_ratio * master_ratio;
}

LightScale scale_of(const Light& light, double master_ratio) {
    LightScale scale = color_of(light);
    scale.multiplier *= shown_level(light, master_ratio) * light.multiplier;
    return scale;
}

std::optional<PunctualLight> punctual_of(const Light& light) {
    if (light.sun) return PunctualLight{"directional"};
    const ies::Photometry& photometry = light.shining()->photometry;
    if (photometry.provenance.format != "KHR_lights_punctual" || light.tilt_factor != 1.0 ||
        opening_of(light).shape != ies::OpeningShape::point)
        return std::nullopt;
    const ies::PhotometricWeb& web = photometry.web;
    if (is_same_web(web, punctual_point_profile()->photometry.web)) return PunctualLight{};
    // A spot's web begins on the axis, and then has the edge from the inner cone to the outer one.
    const bool has_core = web.v_rad.size() > 2 && web.at(0, 0) == web.at(0, 1);
    const PunctualLight spot{"spot", has_core ? web.v_rad[1] : 0.0, web.v_rad.back()};
    if (!(spot.inner_rad < spot.outer_rad)) return std::nullopt;
    const auto again = punctual_spot_profile(spot.inner_rad, spot.outer_rad);
    if (!is_same_web(web, again->photometry.web)) return std::nullopt;
    return spot;
}

}  // namespace gonio::exchange
