// `gonio photometry`: what a photometric file says, offline: quantities, provenance, diagnostics, curves.
#pragma once

#include <cstdint>
#include <optional>
#include <ostream>
#include <span>
#include <string>

#include "ies/choice.h"
#include "ies/core/result.h"
#include "ies/photometry.h"

namespace gonio {

enum class PhotometryFormat : std::uint8_t {
    json,  // one object for one file, an array of objects for several
    svg,   // one SVG document, the luminaires below each other
    text,  // for people, with curves drawn in Braille characters
};

// file: "-" is standard input. Errors: "unreadable"; of ies::read_photometry. Where the name's ending says another
// format than the content, the diagnostics begin with the warning `other_ending`.
Result<ies::Photometry> read_photometric_file(const std::string& file, const ies::Choice& choice = {});

// Reads each file and prints it to out. A file that cannot be read or is refused gives an object with "error" (json) or
// a sentence on err (svg, text), and the others go on. Of files that hold several luminaires, choice says which. With
// ugr_spacing, json and text get CIE 190's table of glare too, at this spacing to height (ies/glare.h). A file that has
// none is refused. Result: 0; 1 if any file was refused; 2 if files is empty.
int run_photometry(std::span<const std::string> files, PhotometryFormat format, std::ostream& out, std::ostream& err,
                   std::optional<double> ugr_spacing = {}, const ies::Choice& choice = {});

}  // namespace gonio
