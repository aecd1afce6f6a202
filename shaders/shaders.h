// The shader files, embedded: "lib/cube.glsl", "passes/gbuffer.vert", "shared/layouts.h", …
#pragma once

#include <span>

#include "cmake/embedded_file.h"

namespace gonio {

std::span<const EmbeddedFile> shader_files();

}  // namespace gonio
