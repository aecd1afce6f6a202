// Strobes: lights that flash by a clock, on for the first half of each period.
#pragma once

namespace gonio {

struct Scene;

// t_s: of any clock, of a sequence its time. Result: whether a strobe of this frequency lets light pass then; without
// one, 0, always.
bool is_flash(double strobe_hz, double t_s);
// Result: whether any light that is not dark for good strobes.
bool any_strobe(const Scene& scene);
// Sets each light's `flash_off` as it is then. No revision changes: nobody has changed the scene. Result: whether the
// picture is another one.
bool set_flashes(Scene& scene, double t_s);

}  // namespace gonio
