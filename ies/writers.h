// PhotometricWeb -> LM-63-2019, EULUMDAT or TM-33 text. What the formats share survives a round trip through the
// readers here: the web to the last bit of each float, opening, lamps, watts, keywords, tilt table.
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
// rectangle, box, circle and round cylinder become rectangle or box. Tilt tables are lost. Direct ratios that the
// photometry has not are those of direct_ratios(). Lines end in CR LF.
std::string write_eulumdat(const Photometry& photometry);

// Result: a TM-33-22 file (root IESTM33-22, Version 1.1) in UTF-8, with the schema's names and order. Lengths are
// metres. Azimuths are LM-63's, so the gonioradiometer is IES_A, IES_B or IES_C. Multiplier and ballast factor are in
// the candela already. What the schema asks for and the photometry has not becomes "unknown", a date 1970-01-01.
// Keywords without an element of their own become comments. Openings other than rectangle, box, circle and vertical
// cylinder become boxes. Lines end in LF.
std::string write_tm33(const Photometry& photometry);

}  // namespace gonio::ies
