// One entry for every photometric format Gonio reads: decides by content, not by file name.
#pragma once

#include <string_view>

#include "ies/choice.h"
#include "ies/lm63.h"

namespace gonio::ies {

// bytes: a whole LM-63, EULUMDAT, TM-33 or GLDF file, or a zip archive with one of them in it. choice: which of several
// luminaires; LM-63 and EULUMDAT have one. Of several files in an archive, choice.variant is the name of one.
// Errors as of the reader that the content selects; no_such_variant, no_such_emitter where the file has no choice;
// several_files; not_photometry, whose message says what the file is instead.
Result<Photometry> read_photometry(std::string_view bytes, const Choice& choice = {});

}  // namespace gonio::ies
