// `gonio convert`: a photometric file in another format, offline.
#pragma once

#include "client/cli/commands.h"

namespace gonio {

// IN may have any format that is read; the ending of OUT decides: .ies, .ldt, or .xml (TM-33). OUT is written wholly or
// not at all; an older file of this name is replaced, unless it is IN. What is written is read again: a flux that
// changed is told. Result: the exit code. Errors: invalid_argument (the ending), same_file, file_unwritable, and those
// of reading.
int convert(const Session& session, const ReadWords& words);

}  // namespace gonio
