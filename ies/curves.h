// Intensity curves of a luminaire, drawn: polar and Cartesian, as SVG and as text for a terminal.
#pragma once

#include <string>
#include <string_view>

#include "ies/photometry.h"

namespace gonio::ies {

// Size of the drawing of one luminaire, in SVG user units.
inline constexpr int kCurvesWidth = 920;
inline constexpr int kCurvesHeight = 460;

// Result: the SVG elements (without the <svg> element) of the polar diagram (left; 0 points down, candela) and the
// Cartesian one (right), with a title in plain text.
std::string curves_svg(const Photometry& photometry, std::string_view title);

// Result: the same for a terminal: lines of Braille characters (UTF-8), at most 80 columns wide.
std::string curves_text(const Photometry& photometry);

}  // namespace gonio::ies
