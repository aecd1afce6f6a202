// Photometric files and plain lights -> the profiles that lights share.
#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <numbers>

#include "ies/photometry_file.h"
#include "ies/product.h"
#include "ies/synthetic.h"
#include "protocol/text/shortened_text.h"
#include "server/assets/assets.h"
#include "server/scene/limits.h"

namespace gonio {
namespace {

std::shared_ptr<const Profile> shared_profile(std::string name, ies::Photometry photometry) {
    auto profile = std::make_shared<Profile>();
    profile->name = std::move(name);
    profile->peak_cd = ies::peak_intensity(photometry.web).in(cd);
    profile->flux_lm = ies::total_flux(photometry.web).in(lm);
    profile->product = shortened_text(ies::product_name(photometry.provenance), kMaxNameBytes);
    profile->photometry = std::move(photometry);
    return profile;
}

// intensity_cd over v_rad, the same in every half-plane.
std::shared_ptr<const Profile> rotational_profile(std::string name, std::vector<double> v_rad,
                                                  const std::vector<float>& intensity_cd,
                                                  const ies::Opening& opening = {}) {
    ies::Photometry photometry;
    photometry.opening = opening;
    photometry.web.v_rad = std::move(v_rad);
    photometry.web.h_rad = {0.0, 2.0 * std::numbers::pi};
    for (int plane = 0; plane < 2; ++plane) {
        photometry.web.candela.insert(photometry.web.candela.end(), intensity_cd.begin(), intensity_cd.end());
    }
    photometry.provenance.format =
        opening.shape == ies::OpeningShape::point ? "KHR_lights_punctual" : "EXT_lights_area";
    photometry.provenance.absolute = true;
    photometry.provenance.lumens_per_lamp = -1.0;
    return shared_profile(std::move(name), std::move(photometry));
}

}  // namespace

Result<std::shared_ptr<const Profile>> make_profile(std::string name, std::string_view bytes) {
    auto photometry = ies::read_photometry(bytes);
    if (!photometry) return photometry.error();
    return shared_profile(std::move(name), std::move(*photometry));
}

std::shared_ptr<const Profile> make_profile(std::string name, ies::Photometry photometry) {
    return shared_profile(std::move(name), std::move(photometry));
}

Result<std::shared_ptr<const Profile>> builtin_profile(const std::string& name) {
    static std::mutex mutex;
    static std::map<std::string, std::shared_ptr<const Profile>> made;  // each of ies::synthetic_luminaires once
    const std::lock_guard lock(mutex);
    if (const auto known = made.find(name); known != made.end()) return known->second;
    const std::string text = ies::synthetic_lm63(name);
    if (text.empty()) return Error{"not_found", "profile", name, "there is no built-in profile of this name"};
    auto profile = make_profile(name, text);
    if (profile) made.emplace(name, *profile);
    return profile;
}

std::shared_ptr<const Profile> unlit_profile(std::string name, std::string code, std::string why) {
    ies::Photometry photometry;
    photometry.web.v_rad = {0.0, std::numbers::pi};
    photometry.web.h_rad = {0.0, 2.0 * std::numbers::pi};
    photometry.web.candela.assign(4, 0.0f);
    photometry.provenance.absolute = true;
    photometry.provenance.lumens_per_lamp = -1.0;
    photometry.diagnostics.push_back({std::move(code), "warning", 0, 0, std::move(why)});
    return shared_profile(std::move(name), std::move(photometry));
}

std::shared_ptr<const Profile> punctual_point_profile() {
    static const auto profile = rotational_profile("point", {0.0, std::numbers::pi}, {1.0f, 1.0f});
    return profile;
}

std::shared_ptr<const Profile> sun_profile() {
    static const auto profile = rotational_profile("sun", {0.0, std::numbers::pi}, {1.0f, 1.0f});
    return profile;
}

// KHR_lights_punctual, "Inner and Outer Cone Angles": with s = 1 / max(0.001, cos inner - cos outer),
// I(v) / I(0) = clamp((cos v - cos outer) s, 0, 1)^2. The web is linear between its angles; 256 steps over the edge
// keep it within 1e-5 of that curve.
std::shared_ptr<const Profile> punctual_spot_profile(double inner_cone_rad, double outer_cone_rad) {
    constexpr int steps = 256;
    constexpr double least_rad = 1e-3;
    const double outer = std::clamp(outer_cone_rad, least_rad, std::numbers::pi / 2.0);
    const double inner = std::clamp(inner_cone_rad, 0.0, outer);
    const double span = std::max(0.001, std::cos(inner) - std::cos(outer));
    const double full = std::acos(std::min(1.0, std::cos(outer) + span));  // where the ratio reaches 1, at most outer
    std::vector<double> v_rad;
    std::vector<float> ratio;
    if (full > 1e-9) {
        v_rad.push_back(0.0);
        ratio.push_back(1.0f);
    }
    for (int i = 0; i <= steps; ++i) {
        const double v = i == steps ? outer : full + (outer - full) * i / steps;
        const double scaled = std::clamp((std::cos(v) - std::cos(outer)) / span, 0.0, 1.0);
        v_rad.push_back(full > 1e-9 || i > 0 ? v : 0.0);
        ratio.push_back(static_cast<float>(scaled * scaled));
    }
    return rotational_profile("spot", std::move(v_rad), ratio);
}

// The web is linear between its angles; at half a degree it keeps within 1e-5 of the cosine.
std::shared_ptr<const Profile> panel_profile(const ies::Opening& opening) {
    constexpr int steps = 180;
    const double sides_m2 = opening.length.in(m)*opening.width.in(m);
    const double area_m2 = opening.shape == ies::OpeningShape::ellipse ? sides_m2 * std::numbers::pi / 4.0 : sides_m2;
    std::vector<double> v_rad;
    std::vector<float> intensity_cd;
    for (int i = 0; i <= steps; ++i) {
        v_rad.push_back(std::numbers::pi / 2.0 * i / steps);
        intensity_cd.push_back(i == steps ? 0.0f : static_cast<float>(area_m2 * std::cos(v_rad.back())));
    }
    return rotational_profile("panel", std::move(v_rad), intensity_cd, opening);
}

}  // namespace gonio
