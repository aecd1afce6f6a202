// The files of the browser page: "index.html", "main.js", …
#pragma once

#include <span>

#include "cmake/embedded_file.h"

namespace gonio {

// Result: those of this folder, embedded, and "properties.js": the table of properties as a module
// (protocol/schema/property.h). They live as long as the program. Any thread.
std::span<const EmbeddedFile> page_files();
// Result: those of this folder alone.
std::span<const EmbeddedFile> page_sources();

}  // namespace gonio
