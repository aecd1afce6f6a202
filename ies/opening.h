// The luminous opening from the signs of its three numbers. Internal to ies/.
#pragma once

#include "ies/photometry.h"
#include "ies/text_scan.h"

namespace gonio::ies::detail {

// Result: the opening that LM-63's width, length and height (metres, signed) stand for. Every version's table is
// understood whatever version the file claims, since files mix them. The tables are 1986/91 (diameter as a negative
// width alone), 1995 and LM-63-2002 table 1. The year decides only where two versions give the same signs different
// meanings. An unknown combination is a point and a warning at offset.
Opening decode_opening(int year, double width, double length, double height, std::size_t offset, Report& report);

}  // namespace gonio::ies::detail
