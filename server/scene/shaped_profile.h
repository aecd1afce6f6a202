// What a light's zoom and gobo make of its profile: a profile as any other, so that all that knows webs shows it.
#pragma once

#include <memory>

#include "server/scene/light.h"

namespace gonio {

inline constexpr double kFineZoom_rad = 0.1 * 0.017453292519943295;  // steps of the zoom; below 10° a tenth of it
inline constexpr int kGoboPlanes = 480;                              // of a web with a gobo, which also turns by them
inline constexpr int kGoboRings = 288;                               // its equal steps from the axis

// Result: the web in other angles from photometric zero, times one factor. Half the peak is `zoom` wide (as
// ies::plane_beams has it, outermost, in the plane C0, else C90), and the flux stays. No light gets behind 90° that was
// not there. Types A and B become Type C in steps of half a degree. A web that lights nothing in front, or has no such
// angle, stays as it is. zoom is the full angle. Where the web cannot tell the width of half its peak, open_width_rad
// has it (Profile::open_width_rad); 0: it can.
ies::PhotometricWeb zoomed_web(const ies::PhotometricWeb& web, Angle zoom, double open_width_rad = 0.0);

// Result: the full angle of half the peak that zoomed_web() goes by, in radians; 0: the web has none.
double beam_width(const ies::PhotometricWeb& web);

// Result: the web times what the gobo lets through: its flux falls by what the gobo holds back. The picture fills the
// full angle of a tenth of the peak, at most 150°, flat as in a gate (by the tangent). Beyond that angle it goes on as
// at its border. Seen on a wall from behind the light, C0 is to its right and C90 up; turn is that of roll. Each value
// is a mean over its step. kGoboRings equal steps from the axis, kGoboPlanes about it.
ies::PhotometricWeb gobo_web(const ies::PhotometricWeb& web, const Gobo& gobo, Angle turn);

// Result: what the light does to its profile, rounded to the steps above. It is Shaping{} where it does nothing: no
// zoom, and no gobo, one that its profile has not or that is open. A sun's is Shaping{}.
Shaping shaping_of(const Light& light);

// Result: the shaped profile; nullptr for Shaping{}. The newest 32 are kept and shared. Any thread; in some
// milliseconds with what lighting makes of it (tables_of), and some ten more where a gobo is shown for the first time
// (packed_gobo.h).
std::shared_ptr<const Profile> shaped_profile(const std::shared_ptr<const Profile>& profile, const Shaping& shaping);

// Sets what follows the light's values: its `shaped` profile.
void follow_shaping(Light& light);

}  // namespace gonio
