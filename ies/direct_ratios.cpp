#include "ies/direct_ratios.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace gonio::ies {

namespace {

constexpr int kRings = 360;  // steps from the nadir to the horizontal
constexpr int kAzimuths = 180;

// A square pattern over a square room, lengths in units of the height.
struct Pattern {
    double side = 0.0;
    double across = 0.0;  // luminaires along a side

    explicit Pattern(double room_index) : side(2.0 * room_index), across(std::max(1.0, std::ceil(side - 1e-9))) {}

    // Result: the part of a row's luminaires whose light stays between the walls where it goes so far to one side.
    double inside(double shift) const {
        return std::clamp(std::floor(across * (1.0 - std::abs(shift) / side) + 0.5), 0.0, across) / across;
    }
};

}  // namespace

std::array<double, 10> direct_ratios(const PhotometricWeb& web) {
    std::array<double, 10> ratios{};
    const double total = total_flux(web).in(lm);
    if (!(total > 0.0)) return ratios;
    std::vector<Pattern> patterns;
    for (const double room_index : kRoomIndices) patterns.emplace_back(room_index);
    constexpr double kRing_rad = 0.5 * kPi / kRings, kAzimuth_rad = 2.0 * kPi / kAzimuths;
    for (int ring = 0; ring < kRings; ++ring) {
        const double v = (ring + 0.5) * kRing_rad;
        const double far = std::tan(v), solid_angle = std::sin(v) * kRing_rad * kAzimuth_rad;
        for (int azimuth = 0; azimuth < kAzimuths; ++azimuth) {
            const double h = (azimuth + 0.5) * kAzimuth_rad;
            const auto direction = direction_of(Goniometer::type_c, Angle::radians(v), Angle::radians(h));
            const double flux = intensity(web, direction).in(cd)*solid_angle;
            if (!(flux > 0.0)) continue;
            // The walls are parallel to the rows, so that both ways can be looked at on their own.
            for (std::size_t k = 0; k < patterns.size(); ++k)
                ratios[k] += flux * patterns[k].inside(far * std::cos(h)) * patterns[k].inside(far * std::sin(h));
        }
    }
    for (double& ratio : ratios) ratio = std::min(ratio / total, 1.0);
    return ratios;
}

}  // namespace gonio::ies
