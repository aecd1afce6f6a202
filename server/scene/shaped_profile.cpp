#include "server/scene/shaped_profile.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <list>
#include <mutex>
#include <numbers>

#include "ies/quantities.h"
#include "server/scene/packed_gobo.h"

namespace gonio {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::size_t kMostKept = 32;
constexpr double kMostPictureEdge_rad = 75.0 * kPi / 180.0;

// Result: the full angle of half (else a tenth) of the peak in the first plane that has one; 0 where none has.
double width_of(const ies::PhotometricWeb& web, bool half) {
    for (const double h : {0.0, kPi / 2.0}) {
        const ies::PlaneBeams beams = ies::plane_beams(web, Angle::radians(h));
        const auto& width = half ? beams.beam.outermost : beams.field.outermost;
        if (beams.peak.in(cd) > 0.0 && width && width->radians() > 0.0) return width->radians();
    }
    return 0.0;
}

// Result: the angle from photometric zero beyond which it is dark.
double lit_to(const ies::PhotometricWeb& web) {
    for (std::size_t v = web.v_rad.size(); v-- > 0;)
        for (std::size_t h = 0; h < web.h_rad.size(); ++h)
            if (web.at(h, v) > 0.0f) return web.v_rad[std::min(v + 1, web.v_rad.size() - 1)];
    return 0.0;
}

bool lights_front(const ies::PhotometricWeb& web) {
    const double peak = ies::peak_intensity(web).in(cd);
    for (std::size_t v = 0; v < web.v_rad.size() && web.v_rad[v] < kPi / 2.0; ++v)
        for (std::size_t h = 0; h < web.h_rad.size(); ++h)
            if (web.at(h, v) >= 0.5f * static_cast<float>(peak)) return peak > 0.0;
    return false;
}

void scale_to(ies::PhotometricWeb& web, double flux_lm) {
    const double own_lm = ies::total_flux(web).in(lm);
    if (own_lm > 0.0)
        for (float& candela : web.candela)
            candela = static_cast<float>(static_cast<double>(candela) * (flux_lm / own_lm));
}

// Mean transmission at a place of the picture, -1..1 each way, y up.
double passes(std::span<const std::uint16_t> transmission, int size_px, double x, double y) {
    const int last = size_px - 1;
    const double u = (x + 1.0) * 0.5 * size_px - 0.5, v = (1.0 - y) * 0.5 * size_px - 0.5;
    const double cu = std::clamp(u, 0.0, static_cast<double>(last)), cv = std::clamp(v, 0.0, static_cast<double>(last));
    const int u0 = static_cast<int>(cu), v0 = static_cast<int>(cv), u1 = std::min(u0 + 1, last),
              v1 = std::min(v0 + 1, last);
    const auto at = [&](int column, int row) {
        return static_cast<double>(transmission[static_cast<std::size_t>(row * size_px + column)]);
    };
    const double fu = cu - u0, fv = cv - v0;
    return ((at(u0, v0) * (1.0 - fu) + at(u1, v0) * fu) * (1.0 - fv) +
            (at(u0, v1) * (1.0 - fu) + at(u1, v1) * fu) * fv) /
           65535.0;
}

}  // namespace

double beam_width(const ies::PhotometricWeb& web) {
    if (web.goniometer == ies::Goniometer::type_c) return width_of(web, true);
    return width_of(ies::as_type_c(web, Angle::degrees(0.5)), true);
}

ies::PhotometricWeb zoomed_web(const ies::PhotometricWeb& given, Angle zoom, double open_width_rad) {
    const ies::PhotometricWeb web =
        given.goniometer == ies::Goniometer::type_c ? given : ies::as_type_c(given, Angle::degrees(0.5));
    const double width = open_width_rad > 0.0 ? open_width_rad : beam_width(web);
    if (width <= 0.0 || !lights_front(web)) return given;
    const double scale = zoom.radians() / width, most = lit_to(web) > kPi / 2.0 + 1e-9 ? kPi : kPi / 2.0;
    ies::PhotometricWeb zoomed;
    zoomed.h_rad = web.h_rad;
    std::size_t whole = 0;  // of its angles that stay within `most`
    while (whole < web.v_rad.size() && web.v_rad[whole] * scale <= most + 1e-12) ++whole;
    for (std::size_t v = 0; v < whole; ++v) zoomed.v_rad.push_back(std::min(web.v_rad[v] * scale, most));
    const bool cut = whole < web.v_rad.size() && (whole == 0 || zoomed.v_rad.back() < most - 1e-9);
    if (cut) zoomed.v_rad.push_back(most);
    if (zoomed.v_rad.size() < 2) return given;
    for (std::size_t h = 0; h < web.h_rad.size(); ++h) {
        for (std::size_t v = 0; v < whole; ++v) zoomed.candela.push_back(web.at(h, v));
        if (cut)
            zoomed.candela.push_back(static_cast<float>(
                ies::intensity_at(web, Angle::radians(most / scale), Angle::radians(web.h_rad[h])).in(cd)));
    }
    scale_to(zoomed, ies::total_flux(given).in(lm));
    return zoomed;
}

ies::PhotometricWeb gobo_web(const ies::PhotometricWeb& given, const Gobo& gobo, Angle turn) {
    const ies::PhotometricWeb web =
        given.goniometer == ies::Goniometer::type_c ? given : ies::as_type_c(given, Angle::degrees(0.5));
    const double end = std::min(lit_to(web), kPi), width = width_of(web, false);
    const std::span<const std::uint16_t> transmission = transmission_of(gobo);
    if (transmission.empty() || end <= 0.0) return given;
    const double edge = std::tan(std::min(width > 0.0 ? width / 2.0 : end, kMostPictureEdge_rad));
    constexpr int kParts = 2;  // of a step, each way, that its mean is taken of
    ies::PhotometricWeb cut;
    for (int v = 0; v <= kGoboRings; ++v) cut.v_rad.push_back(end * v / kGoboRings);
    for (int h = 0; h <= kGoboPlanes; ++h) cut.h_rad.push_back(2.0 * kPi * h / kGoboPlanes);
    std::array<double, (kGoboRings + 1) * kParts> radii{};  // of the picture
    for (int i = 0; i < static_cast<int>(radii.size()); ++i) {
        const double v = std::abs(end / kGoboRings * (i / kParts + (i % kParts + 0.5) / kParts - 0.5));
        radii[static_cast<std::size_t>(i)] = v < 1.55 ? std::min(std::tan(v) / edge, 1e3) : 1e3;
    }
    const bool axial = web.h_rad.size() == 2;
    std::vector<double> open(axial ? cut.v_rad.size() : 0);
    for (std::size_t v = 0; v < open.size(); ++v)
        open[v] = ies::intensity_at(web, Angle::radians(cut.v_rad[v]), Angle::radians(0.0)).in(cd);
    cut.candela.resize(cut.v_rad.size() * cut.h_rad.size());
    for (std::size_t h = 0; h < static_cast<std::size_t>(kGoboPlanes); ++h) {
        std::array<std::array<double, 2>, kParts> rays{};  // cosine and sine of the azimuths, in the picture
        for (int part = 0; part < kParts; ++part) {
            const double at =
                2.0 * kPi / kGoboPlanes * (static_cast<double>(h) + (part + 0.5) / kParts - 0.5) - turn.radians();
            rays[static_cast<std::size_t>(part)] = {std::cos(at), std::sin(at)};
        }
        for (std::size_t v = 0; v < cut.v_rad.size(); ++v) {
            double sum = 0.0;
            for (std::size_t part = 0; part < kParts; ++part)
                for (const auto& [cosine, sine] : rays)
                    sum += passes(transmission, gobo.size_px, radii[v * kParts + part] * cosine,
                                  radii[v * kParts + part] * sine);
            const double whole =
                axial ? open[v]
                      : ies::intensity_at(web, Angle::radians(cut.v_rad[v]), Angle::radians(cut.h_rad[h])).in(cd);
            cut.candela[h * cut.v_rad.size() + v] = static_cast<float>(whole * sum / (kParts * kParts));
        }
    }
    std::copy_n(cut.candela.begin(), cut.v_rad.size(), cut.candela.end() - static_cast<long>(cut.v_rad.size()));
    return cut;
}

Shaping shaping_of(const Light& light) {
    Shaping shaping;
    if (light.sun || !light.profile) return shaping;
    if (light.zoom_rad > 0.0) {
        const double step = light.zoom_rad < 100.0 * kFineZoom_rad ? 0.1 * kFineZoom_rad : kFineZoom_rad;
        shaping.zoom_rad = std::max(std::round(light.zoom_rad / step), 1.0) * step;
    }
    const auto number = static_cast<std::size_t>(std::max(std::lround(light.gobo), 0l));
    const Gobos* gobos = light.profile->gobos.get();
    if (number > 0 && gobos != nullptr && number <= gobos->size() && (*gobos)[number - 1].size_px > 0) {
        constexpr double kTurn_rad = 2.0 * kPi / kGoboPlanes;
        shaping.gobo = static_cast<int>(number);
        shaping.gobo_rad = std::round(std::remainder(light.gobo_rad, 2.0 * kPi) / kTurn_rad) * kTurn_rad;
    }
    return shaping;
}

std::shared_ptr<const Profile> shaped_profile(const std::shared_ptr<const Profile>& profile, const Shaping& shaping) {
    if (shaping == Shaping{}) return nullptr;
    struct Kept {
        std::shared_ptr<const Profile> of;
        Shaping shaping;
        std::shared_ptr<const Profile> made;
    };
    static std::mutex mutex;
    static std::list<Kept> kept;  // the newest first
    const auto find = [&] {
        const auto at =
            std::ranges::find_if(kept, [&](const Kept& one) { return one.of == profile && one.shaping == shaping; });
        if (at != kept.end()) kept.splice(kept.begin(), kept, at);
        return at != kept.end();
    };
    {
        const std::lock_guard lock(mutex);
        if (find()) return kept.front().made;
    }
    auto made = std::make_shared<Profile>();
    made->name = profile->name;
    made->uploaded = profile->uploaded;
    made->gobos = profile->gobos;
    made->photometry = profile->photometry;
    ies::PhotometricWeb& web = made->photometry.web;
    if (shaping.zoom_rad > 0.0) web = zoomed_web(web, Angle::radians(shaping.zoom_rad), profile->open_width_rad);
    if (shaping.gobo > 0)
        web = gobo_web(web, (*profile->gobos)[static_cast<std::size_t>(shaping.gobo - 1)],
                       Angle::radians(shaping.gobo_rad));
    made->peak_cd = ies::peak_intensity(web).in(cd);
    made->flux_lm = ies::total_flux(web).in(lm);
    const std::lock_guard lock(mutex);
    if (find()) return kept.front().made;  // another thread was quicker
    kept.push_front({profile, shaping, std::move(made)});
    if (kept.size() > kMostKept) kept.pop_back();
    return kept.front().made;
}

void follow_shaping(Light& light) {
    const Shaping shaping = shaping_of(light);
    if (shaping == Shaping{}) {
        light.shaped = nullptr;
        light.shaped_of = {};
        return;
    }
    if (light.shaped && light.shaped_of.first == light.profile && light.shaped_of.second == shaping) return;
    light.shaped = shaped_profile(light.profile, shaping);
    light.shaped_of = {light.profile, shaping};
}

}  // namespace gonio
