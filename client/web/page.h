// The files of the browser page, embedded: "index.html", "main.js", …
#pragma once

#include <span>

#include "cmake/embedded_file.h"

namespace gonio {

std::span<const EmbeddedFile> page_files();

}  // namespace gonio
