// The unified glare rating (UGR) of CIE 117:1995 and its tabular method (CIE 190:2010).
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "ies/core/result.h"
#include "ies/core/units.h"
#include "ies/photometry.h"

namespace gonio::ies {

// Result: Guth's position index p of a source at distance R along a horizontal line of sight, T across it and H above
// the eye. The index is bilinear in CIE 117 table 4.1. None where the source counts for nothing: T/R above 3, or hidden
// by the brow (H/R above 1.9, less where T/R is small). t_over_r, h_over_r: >= 0.
std::optional<double> position_index(double t_over_r, double h_over_r);

struct GlareSource {
    Luminance luminance;  // of the luminous opening, towards the eye
    SolidAngle solid_angle;
    double position_index = 1.0;
};

// Result: 8 log10(0.25 / Lb Σ L² ω / p²) (CIE 117 eq. 4.1); none where no source or no background shines.
// background: indirect vertical illuminance at the eye / pi, without the direct light of any luminaire.
std::optional<double> unified_glare_rating(Luminance background, std::span<const GlareSource> sources);

// Reflectances of ceiling, walls and floor of a glare table's columns, %.
inline constexpr std::array<std::array<int, 3>, 5> kGlareReflectances = {
    {{70, 50, 20}, {70, 30, 20}, {50, 50, 20}, {50, 30, 20}, {30, 30, 20}}};

struct GlareTable {
    struct Row {
        double x_h = 0.0, y_h = 0.0;  // room across and along the line of sight, in heights of luminaires above the eye
        std::array<Luminance, 5> background;
        // By kGlareReflectances; none where nothing glares. Crosswise: the luminaire's length lies across the view.
        std::array<std::optional<double>, 5> crosswise, endwise;
    };
    double spacing_to_height = 0.25;
    bool regular = true;  // false: the web is not mirrored about both planes; the table holds for one way of hanging it
    std::vector<Row> rows;  // 19
};

// Result: CIE 190's table of a regular array of this luminaire at its own flux. It hangs 2 m above the eye of an
// observer in the middle of a wall. spacing_to_height: 0.25 (catalogues) or 1 (CIE 190's example); 0.1..2. Errors:
// no_opening (its luminance is not defined), all_dark, out_of_range. Any thread.
Result<GlareTable> glare_table(const Photometry& photometry, double spacing_to_height);

}  // namespace gonio::ies
