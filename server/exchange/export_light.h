// What files have of a light as it stands. Pure; any thread.
#pragma once

#include <optional>
#include <string>

#include "ies/core/result.h"
#include "ies/photometry.h"
#include "server/scene/light.h"

namespace gonio::exchange {

// Result: the web that the light has now, as absolute candela times the factor: TILT and ballast factor are in them.
// The opening is the light's. Level, multiplier, colour and master are not in it.
ies::Photometry photometry_of(const Light& light, double factor = 1.0);
// Result: the same as an LM-63 file. Lights whose key is the same have the same file. Errors: "too_large".
Result<std::string> ies_file_of(const Light& light, double factor = 1.0);
std::string ies_key_of(const Light& light, double factor = 1.0);

// Result: level times shutter times master. Files have no word for a shutter: a light whose shutter is closed is saved
// at level 0, and its level lights it again.
double shown_level(const Light& light, double master_ratio);

// Level, shutter, multiplier, colour, white, gel and master of the scene: multiplier · color, whose greatest component
// is 1.
struct LightScale {
    double multiplier = 0.0;  // 0 and white: it is dark
    glm::dvec3 color{1.0};    // linear Rec.709
};
LightScale scale_of(const Light& light, double master_ratio);
// The same of its colour, white and gel alone.
LightScale color_of(const Light& light);

// A light of KHR_lights_punctual: a point, a spot, or a sun.
struct PunctualLight {
    const char* type = "point";
    double inner_rad = 0.0, outer_rad = 0.0;  // of a spot
};
// Result: nothing for a measured light, and for one that shines from an opening.
std::optional<PunctualLight> punctual_of(const Light& light);

// What programs show that know no measured light: a spot, or a point where more than 5 % of the flux goes beyond 85
// degrees from photometric zero. It has the measured light's flux. Half of that is within the spot's inner cone, and
// 95 % within its outer one.
struct PunctualFallback {
    PunctualLight light;
    double cd = 0.0;  // of a spot on its axis
};
PunctualFallback fallback_of(const Light& light);

}  // namespace gonio::exchange
