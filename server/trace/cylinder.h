// Illuminance on what stands upright: a small cylinder, or the half of one. Local coordinates; any thread.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "server/trace/path.h"
#include "server/trace/reference.h"

namespace gonio::trace {

inline constexpr int kAzimuths = 12;  // upright planes that stand for a cylinder or its half

// Result: the direction that an upright plane faces, unit, world. turn: 0..1, of the cylinder's round or of the half's,
// which is evenly about its axis.
glm::dvec3 upright_normal(const MeterPoint& point, double turn);

// Result: the planes whose mean illuminance is the point's own: itself, or kAzimuths upright ones. The mean is exact
// for light that changes slowly with azimuth; of one point source it is up to 2.3 % off.
std::vector<MeterPoint> planes_of(const MeterPoint& point);

// Result: direct illuminance of a cylinder or a half from all luminaires as points, exact, lux, rgb. The mean of CIE
// e-ILV 17-21-055 integrates to Ez = I sin(e) / (pi d²), e from the vertical. A half has 1 + cos(a) times that, a from
// its axis in azimuth.
glm::dvec3 cylinder_direct(const World& world, const MeterPoint& point);

}  // namespace gonio::trace
