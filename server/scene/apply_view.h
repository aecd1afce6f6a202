// The part of apply() that says what the picture shows of the light, and how: view, false colour, exposure and look.
#pragma once

#include <string>

#include "server/scene/view.h"

namespace gonio {
struct Scene;
}  // namespace gonio

namespace gonio::v1 {
class Look;
class SetExposure;
class SetLook;
class SetView;
}  // namespace gonio::v1

namespace gonio {

// Each throws Refused (apply_checks.h) and has then changed nothing but a copy.
void set_view(Scene& scene, const v1::SetView& set);
void set_exposure(Scene& scene, const v1::SetExposure& set);
void set_look(Scene& scene, const v1::SetLook& set);

// Result: why a work light that is switched on does not show; empty: it shows, or is off.
std::string why_no_work_light(const Scene& scene);

// Where the preset that the picture is compared with is saved anew or goes.
void note_preset(Scene& scene, const std::string& name);

// Result: EV100 of an f-number, a time in s and an ISO speed (ISO 2720).
double ev100_of(double aperture, double shutter_s, double iso);
void put_look(const Look& look, v1::Look& out);

}  // namespace gonio
