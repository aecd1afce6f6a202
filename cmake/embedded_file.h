// A file compiled into the program by embed_files() of embed.cmake.
#pragma once

#include <span>
#include <string_view>

namespace gonio {

struct EmbeddedFile {
    std::string_view name;  // path relative to the folder it was embedded from, e.g. "lib/vpl.glsl"
    std::string_view content;
};

}  // namespace gonio
