// Parts of a TM-33 file that are read apart. Internal to ies/.
#pragma once

#include <optional>
#include <string_view>

#include "ies/core/result.h"
#include "ies/photometry.h"
#include "ies/text_scan.h"

namespace pugi {
class xml_node;
}

namespace gonio::ies::detail {

struct Tm33Document {
    std::string_view text;
    Report& report;
    bool other_names;  // of eulumdat-rs
};

// data: the element that holds the intensities. Fills web, symmetry, counts and C0's azimuth of result; the scale in
// its provenance counts.
std::optional<Error> read_tm33_web(const Tm33Document& document, const pugi::xml_node& root, const pugi::xml_node& data,
                                   Photometry& result);

// The luminous opening from the emitter's areas or the luminaire's dimensions.
std::optional<Error> read_tm33_opening(const Tm33Document& document, const pugi::xml_node& root,
                                       const pugi::xml_node& emitter, Opening& opening);

}  // namespace gonio::ies::detail
