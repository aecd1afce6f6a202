// PhotometricWeb: luminous intensity of one luminaire in candela over the full sphere, on its measured grid.
// Immutable once built; shared between threads by shared_ptr<const PhotometricWeb>. Knows no file format.
#pragma once

#include <array>
#include <cstdint>
#include <numbers>
#include <optional>
#include <vector>

#include "ies/core/units.h"

namespace gonio::ies {

inline constexpr double kPi = std::numbers::pi;

// How (v, h) name a direction of the luminaire frame (LM-63-2019 clause 5.11; EXT_lights_ies). Photometric zero (0,0)
// is -Z. For Type C, H = 0 lies on +X and H = 90 on +Y.
//   Type C: `( sin v cos h,  sin v sin h, -cos v)`, v in 0..pi from the zero direction, h in 0..2 pi.
//   Type B: `( cos h sin v, -sin h,       -cos h cos v)`, v in -pi..pi, h in -pi/2..pi/2 (h is the latitude).
//   Type A: `( sin v,       -cos v sin h, -cos v cos h)`, v in -pi/2..pi/2 (v is the latitude), h in -pi..pi.
enum class Goniometer : std::uint8_t { type_c, type_b, type_a };

// A direction in the luminaire frame; unit length unless a function says otherwise.
using Direction = std::array<double, 3>;

struct PhotometricWeb {
    Goniometer goniometer = Goniometer::type_c;
    // Strictly ascending, radians. Type C: symmetry is unfolded, h runs 0..2 pi inclusive (a lone plane
    // becomes {0, 2 pi}); v covers what was measured: outside it the intensity is 0 (no extrapolation).
    std::vector<double> v_rad;  // at least 2 values
    std::vector<double> h_rad;  // at least 2 values
    // Candela after multiplier and ballast factor, h-major: candela[h * v_rad.size() + v]. Finite, >= 0, <= 1e12.
    std::vector<float> candela;

    float at(std::size_t h, std::size_t v) const { return candela[h * v_rad.size() + v]; }
    bool operator==(const PhotometricWeb&) const = default;
};

// Result: I(direction), bilinear in (v, h), 0 outside the measured range. direction: luminaire frame, need not be
// of unit length; a zero vector gives 0. Any thread.
LuminousIntensity intensity(const PhotometricWeb& web, const Direction& direction);

// The same at a direction's (v, h) in the web's goniometer.
LuminousIntensity intensity_at(const PhotometricWeb& web, Angle v, Angle h);

// Result: the direction named by (v, h) in the web's goniometer, unit length.
Direction direction_of(Goniometer goniometer, Angle v, Angle h);

// Result: the largest candela of the grid; 0 for a dark web.
LuminousIntensity peak_intensity(const PhotometricWeb& web);

// Result: total luminous flux in lm, the exact integral of the bilinear web over its own range.
// Type C: dΩ = sin v dv dh. Type B: dΩ = cos h dh dv. Type A: dΩ = cos v dv dh.
LuminousFlux total_flux(const PhotometricWeb& web);

// Result: the web with at most two angles in each step of an axis; nothing where it has no more. Where angles lie
// closer, intensities are means over the steps, edges between two of them stay, and so does the flux.
std::optional<PhotometricWeb> thinned(const PhotometricWeb& web, Angle v_step, Angle h_step);

}  // namespace gonio::ies
