// Zip archives that makers hand out: photometric files among data sheets, pictures and models. Internal to ies/.
#pragma once

#include <string_view>

#include "ies/choice.h"
#include "ies/core/result.h"
#include "ies/photometry.h"

namespace gonio::ies::detail {

// bytes: an archive, within the limits of read_gldf. One with product.xml is GLDF. Else it is taken where it has one
// photometric file: its name ends in .ies, .ldt or .iesxml, or in .xml and its root is one of TM-33's. The note
// `from_archive` names it. choice.variant: the name of the file, with or without its folders, where there are several.
// Errors of its own: no_product (nothing in it is photometry), not_photometry (GDTF, MVR, an office document),
// several_files (the message lists them), no_such_variant. Others are those of read_gldf and of the file's reader, with
// the file's name in the place.
Result<Photometry> read_zip(std::string_view bytes, const Choice& choice);

}  // namespace gonio::ies::detail
