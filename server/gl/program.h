// GLSL programs from the embedded shader files. #include "lib/x.glsl" and "shared/x.h" are resolved depth first, once
// each; features are compiled in by #define, never branched on.
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/gl/objects.h"

namespace gonio::gl {

using Defines = std::vector<std::pair<std::string, std::string>>;

// A program that does not compile or link, with the compiler's message and the file names.
struct ProgramError : std::runtime_error {
    using std::runtime_error::runtime_error;
};
// vertex, fragment: file names under shaders/, e.g. "passes/gbuffer.vert"; fragment may be empty (depth only).
// Throws ProgramError.
Program make_program(std::string_view vertex, std::string_view fragment, const Defines& defines = {});

}  // namespace gonio::gl
