// Files that are there whole or not at all.
#pragma once

#include <string>
#include <string_view>

#include "ies/result.h"

namespace gonio {

// Writes PATH.part beside the file, brings it to the disk and renames it: whoever reads PATH, also after a crash, gets
// the old content or the new one. Errors: "file_unwritable" with the path and the system's reason; PATH is as before.
Result<bool> write_file_atomically(const std::string& path, std::string_view bytes);

// Renames a file to the first free one of PATH<ending>, PATH<ending>-2 … -99 (the last one is replaced). Result: its
// new name. Errors: "file_unwritable".
Result<std::string> set_file_aside(const std::string& path, const std::string& ending);

// Gives a file such a name as well, so that its content outlives being replaced; one that it has from earlier will do.
// Where the disk knows no second names it is renamed. Result and errors: as of set_file_aside.
Result<std::string> keep_file_aside(const std::string& path, const std::string& ending);

}  // namespace gonio
