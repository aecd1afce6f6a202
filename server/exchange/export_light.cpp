#include "server/exchange/export_light.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "ies/core/printed.h"
#include "ies/quantities.h"
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

PunctualFallback fallback_of(const Light& light) {
    const ies::PhotometricWeb& web = light.shining()->photometry.web;
    const double flux_lm = ies::total_flux(web).in(lm), lit_lm = flux_lm * light.tilt_factor;
    const auto part_within = [&](double angle_rad) {
        const Angle angle = Angle::radians(angle_rad);
        const LuminousFlux within = web.goniometer == ies::Goniometer::type_c
                                        ? ies::flux_between(web, Angle::radians(0.0), angle, Angle::radians(0.0),
                                                            Angle::radians(2.0 * std::numbers::pi))
                                        : ies::flux_about_zero(web, {&angle, 1}).front();
        return within.in(lm) / flux_lm;
    };
    constexpr double kWidest_rad = 85.0 / 180.0 * std::numbers::pi, kMostOfIt = 0.95;
    if (!(flux_lm > 0.0) || part_within(kWidest_rad) < kMostOfIt) return {{}, lit_lm / (4.0 * std::numbers::pi)};
    const auto angle_around = [&](double part) {
        double low_rad = 0.0, high_rad = kWidest_rad;
        for (int halved = 0; halved < 12; ++halved) {  // to 0.02 degrees
            const double middle_rad = 0.5 * (low_rad + high_rad);
            (part_within(middle_rad) < part ? low_rad : high_rad) = middle_rad;
        }
        return high_rad;
    };
    const PunctualLight spot{"spot", angle_around(0.5), angle_around(kMostOfIt)};
    // Between the cones the light falls as the square of the way in cos, whose integral is a third
    // (KHR_lights_punctual).
    const double inner = std::cos(spot.inner_rad), outer = std::cos(spot.outer_rad),
                 solid_sr = 2.0 * std::numbers::pi * (1.0 - inner + (inner - outer) / 3.0);
    if (!(spot.inner_rad < spot.outer_rad))
        return {{}, lit_lm / (4.0 * std::numbers::pi)};  // thinner than 0.02 degrees
    return {spot, lit_lm / solid_sr};
}

}  // namespace gonio::exchange
