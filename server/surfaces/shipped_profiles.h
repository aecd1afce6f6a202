// The profiles of profiles/*.toml, embedded.
#pragma once

#include <span>

#include "cmake/embedded_file.h"

namespace gonio {

std::span<const EmbeddedFile> shipped_profiles();

}  // namespace gonio
