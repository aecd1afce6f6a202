// The files of the browser page: "index.html", "main.js", …
#pragma once

#include <span>

#include "cmake/embedded_file.h"

namespace gonio {

// Result: those of this folder, embedded, and "properties.js" and "palettes.js": the tables of properties
// and of the palettes of false colour as modules (protocol/schema/property.h, palette.h). They live as long as the
// program. Any thread.
std::span<const EmbeddedFile> page_files();
// Result: those of this folder alone.
std::span<const EmbeddedFile> page_sources();

}  // namespace gonio
