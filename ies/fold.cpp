#include "ies/fold.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "ies/text_scan.h"

namespace gonio::ies::detail {

namespace {
constexpr double kSameRad = 1e-9;

std::optional<std::size_t> plane_at(const PhotometricWeb& web, double azimuth) {
    const auto above = std::lower_bound(web.h_rad.begin(), web.h_rad.end(), azimuth - kSameRad);
    if (above == web.h_rad.end() || std::abs(*above - azimuth) > kSameRad) return std::nullopt;
    return static_cast<std::size_t>(above - web.h_rad.begin());
}

bool same_column(const PhotometricWeb& web, std::size_t a, std::size_t b) {
    return std::ranges::equal(column(web, a), column(web, b));
}

// Whether every plane has an equal one mirrored about the plane at axis.
bool mirrored_about(const PhotometricWeb& web, double axis) {
    if (!plane_at(web, axis)) return false;
    for (std::size_t i = 0; i < web.h_rad.size(); ++i) {
        double mirror = 2.0 * axis - web.h_rad[i];
        if (mirror < -kSameRad) mirror += 2.0 * kPi;
        const auto other = plane_at(web, mirror);
        if (!other || !same_column(web, i, *other)) return false;
    }
    return true;
}

std::vector<std::size_t> planes_between(const PhotometricWeb& web, double from, double to) {
    std::vector<std::size_t> columns;
    for (std::size_t i = 0; i < web.h_rad.size(); ++i) {
        if (web.h_rad[i] >= from - kSameRad && web.h_rad[i] <= to + kSameRad) columns.push_back(i);
    }
    return columns;
}

}  // namespace

FoldedPlanes fold(const PhotometricWeb& web) {
    const std::size_t last = web.h_rad.size() - 1;
    std::size_t equal = 0;
    while (equal <= last && same_column(web, 0, equal)) ++equal;
    if (equal > last && last == 1) return {Symmetry::axial, {0}};
    const bool closed = same_column(web, 0, last);
    const bool about_0 = closed && plane_at(web, kPi) && mirrored_about(web, kPi);
    const bool about_90 = closed && plane_at(web, 1.5 * kPi) && mirrored_about(web, kPi / 2);
    if (about_0 && about_90) return {Symmetry::quadrant, planes_between(web, 0.0, kPi / 2)};
    if (about_0) return {Symmetry::bilateral_0_180, planes_between(web, 0.0, kPi)};
    if (about_90) return {Symmetry::bilateral_90_270, planes_between(web, kPi / 2, 1.5 * kPi)};
    return {Symmetry::none, planes_between(web, 0.0, 2.0 * kPi)};
}

double tidy_degrees(double radians) {
    return std::round(Angle::radians(radians).degrees() * 1e9) / 1e9 + 0.0;
}

void append_line(std::string& text, std::string_view line) {
    for (const char c : trim(line)) text.push_back(static_cast<unsigned char>(c) < 0x20 ? ' ' : c);
}

}  // namespace gonio::ies::detail
