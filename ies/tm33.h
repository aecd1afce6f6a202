// TM-33 (IES luminaire optical data, XML) -> PhotometricWeb.
#pragma once

#include <string_view>

#include "ies/choice.h"
#include "ies/core/result.h"
#include "ies/photometry.h"

namespace gonio::ies {

// bytes: the whole file, in UTF-8, UTF-16 with a byte order mark or an 8-bit page. Root elements: IESTM33 (TM-33-18),
// IESTM33-22 (TM-33-22 and -23), and LuminaireOpticalData, with the other names that the library eulumdat-rs writes.
//
// Candela = IntData × Multiplier; relative photometry also × BallastFactor. The standard's schema leaves some things
// open. Relative values are taken as candela at RatedLumens, as in LM-63. With eulumdat-rs' names they are cd/klm.
// Lengths are metres; all are millimetres where one is above 20. The intensities are those of all `Quantity` emitters
// together; RatedLumens is of each.
// The side faces C0Face and C180Face have the luminaire's length. So C0 lies across it, as in EULUMDAT: h = C − 90°.
// With a gonioradiometer IES_C it lies along the length, as in LM-63. CIE_A and CIE_B are LM-63's Types A and B.
// The luminous opening comes from EmissionAreas, else it is the Dimensions' flat rectangle.
//
// Errors of the file: empty_file, too_large (64 MiB), too_many_elements, xml_doctype, bad_xml, unknown_root,
// no_emitter, no_such_emitter, no_such_variant, no_luminous_data, no_intensities. Errors of values: not_a_number,
// not_finite, missing_angle, duplicate_value, incomplete_grid, grid_too_large, candela_too_large, bad_symmetry,
// bad_type, tilt_too_long. Errors of angles: angle_out_of_range, angles_not_monotone, tilt_angles_not_ascending. Any
// thread.
Result<Photometry> read_tm33(std::string_view bytes, const Choice& choice = {});

}  // namespace gonio::ies
