// Photometric quantities of a web: fluxes, beam angles, spacing, CIE and BUG codes, luminance of the opening.
// All integrals are exact for the bilinear web of Type C. The zones of Types A and B are sums over parts of their own
// grids (flux_about_zero); their BUG rating goes through as_type_c at half a degree. Both are scaled to the exact
// total.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "ies/core/units.h"
#include "ies/photometry.h"
#include "ies/web.h"

namespace gonio::ies {

// Result: the same light on a Type C grid of equal steps over the sphere, each node exact, linear between.
// step: 0.25..30 degrees, rounded so that it divides 180 degrees.
PhotometricWeb as_type_c(const PhotometricWeb& web, Angle step);

// Result: flux within v0..v1 and h0..h1 of a Type C web, exact. Ranges are cut to 0..pi and 0..2 pi.
// Types A and B: 0 (convert first).
LuminousFlux flux_between(const PhotometricWeb& web, Angle v0, Angle v1, Angle h0, Angle h1);

// Result: of a Type A or B web the flux within each of these angles from photometric zero. Every cell of its grid is
// cut into parts of at most a quarter of a degree, each whole within the angles that its middle is in. So the flux
// within pi is the total, and a beam narrower than any step is not lost. Type C: 0 (flux_between).
std::vector<LuminousFlux> flux_about_zero(const PhotometricWeb& web, std::span<const Angle> angles);

// Full angles, in one plane through photometric zero, between directions of a fraction of a reference intensity.
struct BeamAngles {
    std::optional<Angle> outermost;  // between the outermost directions of that fraction of the plane's maximum
    std::optional<Angle> lobe;       // of the contiguous lobe around the plane's maximum
    std::optional<Angle> centre;     // of the lobe around the axis, relative to the intensity there (CIE centre beam)
};

struct PlaneBeams {
    LuminousIntensity peak;
    BeamAngles beam;   // 50 %
    BeamAngles field;  // 10 %
};

// Result: beam and field angles in the plane through the axis that contains azimuth h and h + pi. They are of the
// hemisphere that its maximum lies in: an uplight's are those of the same light turned over. A dark plane has none.
// Types A and B: h below 45 degrees gives the line H = 0 (it contains x), else the line V = 0.
PlaneBeams plane_beams(const PhotometricWeb& web, Angle h);

// Fluxes of IES TM-15-11 and the rating from its table A-1 to A-3 (addendum A): each 0..5.
struct BugRating {
    LuminousFlux forward_low, forward_medium, forward_high, forward_very_high;  // 0-30, 30-60, 60-80, 80-90 degrees
    LuminousFlux back_low, back_medium, back_high, back_very_high;
    LuminousFlux up_low, up_high;  // 90-100, 100-180 degrees
    bool quadrilateral = false;    // Type V: the glare limits of symmetrical luminaires apply
    int backlight = 0, uplight = 0, glare = 0;
};

// Result: the rating for a luminaire hung as measured, street side at azimuth street_side (0, 90, 180 or 270 degrees).
BugRating bug_rating(const PhotometricWeb& web, Angle street_side);

// Result: area of the opening as seen from direction (luminaire frame, unit length); 0 for a point.
Area projected_area(const Opening& opening, const Direction& direction);

// Result: I / projected area; none where the area vanishes.
std::optional<Luminance> opening_luminance(const Photometry& photometry, const Direction& direction);

struct LuminanceRow {
    Angle v;
    std::array<std::optional<Luminance>, 3> at_h;  // azimuth 0, 45, 90 degrees
};

struct Quantities {
    LuminousFlux total, downward, upward;  // downward: the hemisphere of photometric zero
    std::array<LuminousFlux, 18> zonal{};  // 0-10, 10-20, … 170-180 degrees from photometric zero
    LuminousIntensity peak;
    Angle peak_v, peak_h;  // where it is first met on the grid, in the web's goniometer
    // The file's own C0-C180 and C90-C270 planes (EULUMDAT's C0 is the web's h = 270 degrees); Types A and B: the lines
    // V = 0 and H = 0.
    std::array<PlaneBeams, 2> planes;
    std::optional<Angle> beam, field;                // outermost, in the first plane that is not dark
    std::optional<Angle> widest_beam, widest_field;  // outermost, the larger of the two planes
    std::optional<double> light_output_ratio;        // flux / rated lumens of the lamps; none where absolute
    std::optional<double> efficacy_lm_per_w;         // none without input watts
    // Spacing to mounting height at which the midpoint of two (of four) luminaires is as bright as below one:
    // planes 0-180 and 90-270, diagonal. None where photometric zero is dark.
    std::array<std::optional<double>, 3> spacing_criterion;
    std::array<double, 5> cie_flux_code{};  // N1..N5 in percent (CIE 52); N5 = light output ratio, 100 where absolute
    BugRating bug;
    std::vector<LuminanceRow> luminance;  // 0, 45, 55, 65, 75, 85 degrees; empty for a point
};

// Result: "point", "rectangle", "vertical_cylinder", …: the enumerator's name.
const char* shape_name(OpeningShape shape);

// Result: everything above for one luminaire. Any thread.
Quantities quantities(const Photometry& photometry);

}  // namespace gonio::ies
