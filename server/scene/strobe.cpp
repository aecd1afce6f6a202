#include "server/scene/strobe.h"
#include "server/scene/scene.h"

#include <algorithm>
#include <cmath>

namespace gonio {

static bool strobes(const Light& light) {
    return light.strobe_hz > 0.0 && light.level_ratio > 0.0 && light.shutter_ratio > 0.0;
}

bool is_flash(double strobe_hz, double t_s) {
    const double periods = t_s * strobe_hz;
    return strobe_hz <= 0.0 || periods - std::floor(periods) < 0.5;
}

bool any_strobe(const Scene& scene) {
    return std::ranges::any_of(scene.lights, strobes);
}

bool set_flashes(Scene& scene, double t_s) {
    bool another = false;
    for (Light& light : scene.lights) {
        const bool off = !is_flash(light.strobe_hz, t_s);
        another = another || (off != light.flash_off && strobes(light));
        light.flash_off = off;
    }
    return another;
}

}  // namespace gonio
