// EULUMDAT text (.ldt files) -> PhotometricWeb. One value per line, in a fixed order.
#pragma once

#include <cstddef>
#include <string_view>

#include "ies/core/result.h"
#include "ies/photometry.h"

namespace gonio::ies {

// text: the whole file, any line end. Its encoding is UTF-8, Latin-1 or code page 850, or UTF-16 with a byte order
// mark. The lamp_set says which of the file's lamp sets the luminaire burns. The set's total flux turns cd/klm into cd.
// Decimal commas are accepted.
// Orientation: EULUMDAT's C0 plane lies across the luminaire, LM-63's along it, so that C90 becomes the web's h = 0
// (h = C - 90 degrees). Isym 0-4 are unfolded to the full circle.
// Errors: empty_file, too_large, truncated, not_a_number, not_finite, not_an_integer, bad_count, bad_symmetry,
// grid_too_large, no_such_lamp_set, angles_not_monotone, angle_out_of_range, candela_too_large.
// Any thread.
Result<Photometry> read_eulumdat(std::string_view text, std::size_t lamp_set = 0);

// Result: whether the first lines are numbers where EULUMDAT has them (type indicator, symmetry, counts).
bool looks_like_eulumdat(std::string_view text);

}  // namespace gonio::ies
