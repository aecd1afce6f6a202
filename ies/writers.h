// PhotometricWeb -> LM-63-2019 or EULUMDAT text. What the formats share survives a round trip through the readers here:
// the web to the last bit of each float, opening, lamps, watts, keywords, tilt table.
#pragma once

#include <string>

#include "ies/photometry.h"

namespace gonio::ies {

// Result: an LM-63-2019 file in metres with candela multiplier and ballast factor 1 (they are in the candela already).
// The shortest of 0, 0-90, 0-180, 90-270 and 0-360 that loses nothing is written. Missing required keywords become
// "unknown"; label lines become [OTHER]. Types A and B keep their grid. Lines end in CR LF.
std::string write_lm63(const Photometry& photometry);

// Result: a EULUMDAT file in UTF-8. Candela are divided by the rated lumens (relative) or by the flux of the web
// (absolute: lamp count -1). Azimuths are turned back, C = h + 90 degrees. The format has limits. Types A and B are
// resampled to Type C at 1 degree. A web whose planes at 0 and 360 differ keeps the one at 0. Openings other than
// rectangle, box, circle and round cylinder become rectangle or box. Tilt tables are lost. Lines end in CR LF.
std::string write_eulumdat(const Photometry& photometry);

}  // namespace gonio::ies
