// From the angles and values that a file gives to the web over the full sphere: order, symmetry, missing planes.
// Internal to ies/; shared by the readers.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "ies/photometry.h"
#include "ies/text_scan.h"

namespace gonio::ies::detail {

// A plane of a web: its azimuth and the column of the file that it takes its values from.
struct Plane {
    double deg = 0.0;
    std::size_t column = 0;
};

// Appends the mirror image of the planes about the last one.
void mirror_about_last(std::vector<Plane>& planes);

// Sets the first and last plane to their exact angles, which files miss by rounding, and drops inner planes that do not
// lie between these. At least two planes.
void snap_ends(std::vector<Plane>& planes, double first_deg, double last_deg);

// A file's grid as written. candela is h-major, already scaled, finite and >= 0; its size is the product of the others.
struct FileGrid {
    Goniometer goniometer = Goniometer::type_c;
    std::vector<double> v_deg;
    std::vector<double> h_deg;
    std::vector<float> candela;
    // Type C only: the planes of one full turn, ascending, if the format says how its columns unfold (EULUMDAT);
    // h_deg is then not looked at. Empty: h_deg decides, by LM-63's rules.
    std::vector<Plane> planes;
    Symmetry symmetry = Symmetry::none;  // together with planes
    // Type C: of the file's C0 plane in the web, where it is not 0; a web with one plane has none.
    double zero_plane_deg = 0.0;
    // Offsets in the text where each list starts, for diagnostics.
    std::size_t v_offset = 0;
    std::size_t h_offset = 0;
    std::size_t candela_offset = 0;
};

// Why a grid is refused: the index-th angle of one list.
struct GridFault {
    std::string code;  // "angles_not_monotone" or "angle_out_of_range"
    std::string message;
    bool vertical = false;
    std::size_t index = 0;
};

struct Unfolded {
    PhotometricWeb web;
    Symmetry symmetry = Symmetry::none;
    bool irregular_h = false;  // a horizontal range that no LM-63 version allows, repaired
    std::optional<GridFault> fault;
};

// Result: the web over the full sphere (LM-63-2002 clauses 5.13-5.15; Types A and B keep their own grid), or a fault.
// Descending angles are turned round, a missing 360 plane is closed; each repair is reported.
Unfolded unfold(FileGrid grid, Report& report);

// Turns a Type C web about the vertical, counter-clockwise seen from above; a plane at 0 is interpolated where none
// falls there.
void turn_about_vertical(PhotometricWeb& web, Angle turn, Report& report);

}  // namespace gonio::ies::detail
