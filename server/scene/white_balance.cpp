#include "server/scene/white_balance.h"

#include "server/scene/white.h"

namespace gonio {
namespace {

// By columns: linear Rec.709 -> XYZ (IEC 61966-2-1), XYZ -> the Bradford primaries.
constexpr glm::dmat3 kXyzFromRgb{0.4124564, 0.2126729, 0.0193339, 0.3575761, 0.7151522,
                                 0.1191920, 0.1804375, 0.0721750, 0.9503041};
constexpr glm::dmat3 kConesFromXyz{0.8951, -0.7502, 0.0389, 0.2664, 1.7135, -0.0685, -0.1614, 0.0367, 1.0296};

glm::dvec3 xyz_of(const glm::dvec2& xy) {
    return {xy.x / xy.y, 1.0, (1.0 - xy.x - xy.y) / xy.y};
}

}  // namespace

glm::dmat3 white_balance(double white_k, double white_duv) {
    if (white_k == 0.0) return glm::dmat3(1.0);
    const glm::dvec3 from = kConesFromXyz * xyz_of(white_xy(white_k, white_duv)),
                     to = kConesFromXyz * xyz_of(white_xy(0.0, 0.0));
    const glm::dmat3 cones_from_rgb = kConesFromXyz * kXyzFromRgb;
    const glm::dvec3 gain = to / from;
    const glm::dmat3 adapt{gain.x, 0, 0, 0, gain.y, 0, 0, 0, gain.z};
    return glm::inverse(cones_from_rgb) * adapt * cones_from_rgb;
}

}  // namespace gonio
