// Colour filters in front of a light, by their measured chromaticity and transmission.
#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "ies/core/result.h"

namespace gonio {

struct GelMeasurement {
    glm::dvec2 of_xy{0.0}, xy{0.0};   // CIE 1931: of the light, and behind the gel
    double transmission_ratio = 1.0;  // luminous, 0..1
};

struct Gel {
    std::string name;
    std::vector<GelMeasurement> measured;  // 1 or 2, with lights of different colour temperature, the warmer first
    std::string source;                    // where the numbers come from
};
using Gels = std::vector<std::shared_ptr<const Gel>>;

inline constexpr std::size_t kMaxGels = 1024;                          // of a file; more are refused: "too_large"
inline constexpr std::size_t kMaxGelFileBytes = std::size_t{1} << 20;  // likewise

// Result: those that need no file: filters of LEE Filters, as the maker publishes them. Any thread.
const Gels& builtin_gels();
// text: CSV, one line for each gel and light: name,transmission,x,y,of_x,of_y[,source]; empty lines and lines that
// begin with # say nothing. A gel may have two lines, with lights of different colour temperature. A name of
// builtin_gels() replaces that one. Errors: "bad_gels" with the line as place, "too_large".
Result<Gels> read_gels(std::string_view text);
// more: of a file, may be null. Result: the built-in ones and those, each name once, in that order.
Gels all_gels(const Gels* more);
// Result: the gel of this name, or else the first whose name begins with it and a blank: "L201"; or nullptr.
std::shared_ptr<const Gel> find_gel(const Gels* more, std::string_view name);

// Result: what a light's colour is multiplied by behind the gel: white_factors(cct_k, duv) without one. The gel
// multiplies linear Rec.709, as its measurement did with its light; the luminance of the result is the transmission, so
// that lux are those of the light times it. Of two measurements both count, by the light's place between theirs in
// mired (1e6 / K). Where Rec.709 has no such chromaticity: rgb_of_xy(). No factor is below 0 or above 13.9. Any thread.
glm::dvec3 filtered_white(double cct_k, double duv, const Gel* gel);

}  // namespace gonio
