// The inverse of grid.h: which of a full circle's planes a file needs to hold. Internal to ies/.
#pragma once

#include <charconv>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "ies/photometry.h"

namespace gonio::ies::detail {

struct FoldedPlanes {
    Symmetry symmetry = Symmetry::none;
    std::vector<std::size_t> columns;  // indices into h_rad, ascending azimuth
};

// Result: the smallest set of planes of a Type C web from which LM-63's symmetry rules give the same web back, compared
// bit by bit. It is {0}, 0-90, 0-180, 90-270, else all.
FoldedPlanes fold(const PhotometricWeb& web);

// Result: the intensities of the web's plane h.
inline std::span<const float> column(const PhotometricWeb& web, std::size_t h) {
    return {web.candela.data() + h * web.v_rad.size(), web.v_rad.size()};
}

// Result: an angle in degrees rounded to 1e-9, so that what was read as "22.5" is written as "22.5".
double tidy_degrees(double radians);

// Appends the shortest text that reads back as the same number (float: as the same float).
template <typename Number>
void append_number(std::string& text, Number value) {
    char buffer[64];
    text.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr);
}

// Appends text without line ends, control bytes and blanks at its ends.
void append_line(std::string& text, std::string_view line);

}  // namespace gonio::ies::detail
