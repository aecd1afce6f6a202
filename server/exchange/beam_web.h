// A GDTF beam -> the web of its light. GDTF gives flux and two angles; the trade reads BeamAngle as the full angle of
// half the peak and FieldAngle as that of a tenth.
#pragma once

#include <optional>

#include "ies/core/units.h"
#include "ies/web.h"
#include "server/exchange/gdtf.h"

namespace gonio::gdtf {

// Result: the web, candela, of the beam's flux, by its type:
//
// Wash, Spot, PC, Fresnel: type C, rotationally symmetric about the zero direction. With θb, θf half of the angles:
//   I(θ) = I0 2^(-(θ/θb)^p), p = ln(ln 10 / ln 2) / ln(θf/θb), I0 from ∫ I dΩ = flux.
// Where the field is no wider than the beam (GDTF's defaults): a flat cone of half angle θb, I0 = Φ / (2π(1 - cos θb)).
// Its edge is soft for Wash, PC and Fresnel: half of I0 at θb, from 0.8 θb to 1.2 θb. Nothing goes beyond 90° unless an
// angle is above 180°: then it goes all around, and at 360° it is a bulb, Φ/4π everywhere.
//
// Rectangle: type B, a hard pyramid that lights a plane before it evenly. At distance d it is d/ThrowRatio wide, along
// X, and its height is its width by RectangleRatio: I(θ) = Φ · ThrowRatio² · RectangleRatio / cos³θ. Each side ends at
// kMostPyramid_deg from the axis at most.
//
// None, Glow: no beam; the geometry itself glows. Lambertian in front of it, I(θ) = Φ/π · cos θ.
//
// zoom: takes the place of the beam angle, and of a pyramid's angle across its width; field/beam, the sides' ratio and
// flux stay. What glows has no zoom. Any thread.
inline constexpr double kMostPyramid_deg = 80.0;
ies::PhotometricWeb beam_web(const Beam& beam, std::optional<Angle> zoom = std::nullopt);

// Whether the type sends out no beam.
constexpr bool glows(BeamType type) {
    return type == BeamType::none || type == BeamType::glow;
}

}  // namespace gonio::gdtf
