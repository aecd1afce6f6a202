// What a photometry reader returns, whatever the file format: the web, where it came from, what was odd about it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ies/core/units.h"
#include "ies/web.h"

namespace gonio::ies {

// A tolerated deviation or a note, with a stable code (ies/README.md lists them). One entry per code: the first place
// where it was met. Errors are Result errors, never diagnostics.
struct Diagnostic {
    std::string code;      // snake_case, stable, e.g. "trailing_data"
    std::string severity;  // "note" or "warning"
    int line = 0;          // 1-based; 0 where no line is meant
    int column = 0;        // 1-based, in bytes
    std::string message;   // one sentence
    bool operator==(const Diagnostic&) const = default;
};

// The planes that the file gives, before unfolding.
enum class Symmetry : std::uint8_t {
    axial,             // one plane
    quadrant,          // mirrored about both principal planes
    bilateral_0_180,   // mirrored about the 0-180 plane
    bilateral_90_270,  // mirrored about the 90-270 plane
    none,              // all planes given
    lateral,           // Types A and B: one half given, mirrored about the 0 plane
};

struct Provenance {
    std::string format;       // "LM-63-2002", "EULUMDAT", …
    double multiplier = 1.0;  // candela multiplying factor
    double ballast_factor = 1.0;
    double ballast_lamp_factor = 1.0;  // 12th number of LM-63; scales in 1986 and 1991 files only
    double scale = 1.0;                // the product that every candela value of the file was multiplied by
    bool absolute = false;             // candela are the luminaire's own, not those of lamps of rated lumens
    bool radiometric = false;  // the file's intensities are W/sr or mW/sr; they are kept as if they were candela
    int lamps = 1;
    double lumens_per_lamp = 0.0;  // lm, as stated; -1 where absolute
    double rated_lumens = 0.0;     // lm of all lamps together, what relative candela refer to; 0 where absolute
    double input_watts = 0.0;
    Symmetry symmetry = Symmetry::none;
    double zero_plane_rad = 0.0;     // azimuth of the file's C0 plane in the web: 0, EULUMDAT 3 pi / 2
    int file_vertical_angles = 0;    // as written in the file, before unfolding
    int file_horizontal_angles = 0;  // planes whose values the file holds
    std::vector<std::pair<std::string, std::string>> keywords;  // in file order, [MORE] joined; key "" = label line
    bool operator==(const Provenance&) const = default;
};

// TILT=INCLUDE: how the lamp's output follows the luminaire's tilt (LM-63-2002 clause 5.6 ff.).
struct TiltTable {
    // 1: lamp vertical while the luminaire aims down; 2: lamp horizontal and stays so when tilted in the 0-180 plane;
    // 3: lamp horizontal and tilts with the luminaire.
    int lamp_geometry = 1;
    std::vector<double> angle_rad;  // ascending, 0 = aimed straight down
    std::vector<double> factor;     // same count; >= 0; 1 at angle 0
    bool operator==(const TiltTable&) const = default;
};

// Result: the factor on all candela at this tilt (angle between aim and nadir, 0..pi), linear between the entries and
// constant beyond them; 1 for an empty table.
double tilt_factor(const TiltTable& table, Angle tilt);

// The luminous opening, LM-63-2002 table 1 and its predecessors. Sizes are those of the bounding box, metres, >= 0:
// length along the 0-180 plane (luminaire x), width along 90-270 (y), height vertical (z).
enum class OpeningShape : std::uint8_t {
    point,
    rectangle,                   // flat, facing down
    box,                         // with luminous sides
    ellipse,                     // flat; circle where width = length
    vertical_cylinder,           // elliptic where width != length
    ellipsoid,                   // sphere where all are equal
    horizontal_cylinder_length,  // axis along the length
    horizontal_cylinder_width,   // axis along the width
    vertical_ellipse,            // upright disc facing the photometric horizontal
};

struct Opening {
    OpeningShape shape = OpeningShape::point;
    Length width, length, height;
    bool operator==(const Opening&) const = default;
};

// One of the lamp sets of a EULUMDAT file.
struct LampSet {
    int count = 1;  // negative: absolute photometry
    std::string type;
    double total_lumens = 0.0;  // of all lamps of the set
    std::string colour_appearance;
    std::string colour_rendering;
    double watts = 0.0;
    bool operator==(const LampSet&) const = default;
};

// What a EULUMDAT file says beyond the web, in its own units and order (line numbers of the format in brackets).
struct EulumdatFields {
    std::string company;                                      // (1)
    int type_indicator = 2;                                   // (2) 0 or 1: axial symmetry, 2: linear, 3: other
    int isym = 0;                                             // (3)
    double plane_step_deg = 0.0;                              // (5)
    double gamma_step_deg = 0.0;                              // (7)
    std::string report, name, number, file_name, date;        // (8)-(12)
    double length_mm = 0.0, width_mm = 0.0, height_mm = 0.0;  // (13)-(15) width 0: round
    double downward_flux_percent = 0.0;                       // (22)
    double light_output_ratio_percent = 100.0;                // (23)
    double conversion_factor = 1.0;                           // (24)
    double tilt_deg = 0.0;                                    // (25) during the measurement
    std::vector<LampSet> lamp_sets;                           // (26)
    std::array<double, 10> direct_ratios{};                   // (27)
    std::size_t lamp_set = 0;                                 // the one that the candela are for
    bool operator==(const EulumdatFields&) const = default;
};

struct Photometry {
    PhotometricWeb web;
    Provenance provenance;
    std::vector<Diagnostic> diagnostics;
    Opening opening;
    std::optional<TiltTable> tilt;
    // LM-63-2019 table 2, as digits ("1.10000"); empty in other formats.
    std::string file_generation_type;
    std::optional<EulumdatFields> eulumdat;  // set by read_eulumdat only
    bool operator==(const Photometry&) const = default;
};

inline constexpr std::size_t kMaxFileBytes = 64u << 20;  // larger files are refused: "too_large"
inline constexpr std::size_t kMaxGridValues = 4u << 20;  // nV * nH beyond this is refused: "grid_too_large"
inline constexpr std::size_t kMaxTiltPairs = 10'000;     // beyond this: "tilt_too_long"
inline constexpr double kMaxCandela = 1e12;              // beyond this: "candela_too_large"

}  // namespace gonio::ies
