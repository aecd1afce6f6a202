// One entry for every photometric format Gonio reads: decides by content, not by file name.
#pragma once

#include <string_view>

#include "ies/lm63.h"

namespace gonio::ies {

// bytes: a whole LM-63 or EULUMDAT file. Errors as of the reader that the content selects.
Result<Photometry> read_photometry(std::string_view bytes);

}  // namespace gonio::ies
