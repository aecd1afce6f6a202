// A GDTF beam -> the web of its light. GDTF gives flux and two angles; the trade reads BeamAngle as the full angle of
// half the peak and FieldAngle as that of a tenth.
#pragma once

#include <optional>

#include "ies/core/units.h"
#include "ies/web.h"
#include "server/exchange/gdtf.h"

namespace gonio::gdtf {

// Result: type C, rotationally symmetric about the zero direction, candela. With θb, θf half of the angles:
//   I(θ) = I0 2^(-(θ/θb)^p), p = ln(ln 10 / ln 2) / ln(θf/θb), I0 from ∫ I dΩ = flux.
//
// Where the field is no wider than the beam (GDTF's defaults): a flat cone of half angle θb, I0 = Φ / (2π(1 - cos θb)).
// Its edge is soft for Wash, PC and Fresnel: half of I0 at θb, from 0.8 θb to 1.2 θb. Nothing goes beyond 90°.
// zoom: takes the place of the beam angle; field/beam and flux stay. Any thread.
ies::PhotometricWeb beam_web(const Beam& beam, std::optional<Angle> zoom = std::nullopt);

}  // namespace gonio::gdtf
