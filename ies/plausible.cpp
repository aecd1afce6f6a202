#include "ies/plausible.h"

#include <algorithm>
#include <cstdio>

namespace gonio::ies::detail {

namespace {

// W/sr or mW/sr in any keyword, as test laboratories write it ([_INTENSITYUNITS] mW/sr): no standard has a field for
// it.
bool says_watts_per_steradian(const Provenance& provenance) {
    return std::any_of(provenance.keywords.begin(), provenance.keywords.end(),
                       [](const auto& keyword) { return to_upper(keyword.second).find("W/SR") != std::string::npos; });
}

}  // namespace

void check_plausible(Photometry& photometry, LuminousFlux total, std::size_t offset, Report& report) {
    photometry.provenance.radiometric = says_watts_per_steradian(photometry.provenance);
    if (photometry.provenance.radiometric) {
        report.warn(
            "radiometric", 0,
            "the intensities are radiant, in W/sr or mW/sr by a keyword: they are no candela, and no lumens or lux "
            "come of them");
    }
    const double rated_lm = photometry.provenance.rated_lumens;
    const double ratio = rated_lm > 0.0 ? total.in(lm) / rated_lm : 0.0;
    if (ratio > kMostOutputRatio) {
        char text[96];
        std::snprintf(text, sizeof text, "the intensities give %.3g times the lumens of the lamps", ratio);
        report.warn("output_ratio", offset, text);
    }
}

}  // namespace gonio::ies::detail
