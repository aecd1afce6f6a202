// LM-63 text (IES files, 1986 to 2019) -> PhotometricWeb. The body is read as one stream of numbers, never by line.
#pragma once

#include <string_view>

#include "ies/core/result.h"
#include "ies/photometry.h"

namespace gonio::ies {

// text: the whole file, any line end, any 8-bit encoding (UTF-16 with a byte order mark is decoded).
// Errors carry code, "line L column C" and the token. Codes: empty_file, too_large, no_tilt, truncated, not_a_number,
// not_finite, not_an_integer, bad_count, grid_too_large, bad_type, tilt_too_long, tilt_angles_not_ascending,
// angles_not_monotone, angle_out_of_range, candela_too_large, decimal_comma, trailing_data.
// Pure function: opens no file (TILT=<file> is reported, never opened). Linear time. Any thread.
Result<Photometry> read_lm63(std::string_view text);

}  // namespace gonio::ies
