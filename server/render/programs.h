// Shader programs by file names and options, each compiled once, when it is first asked for; and the few GL objects
// that passes of all targets share.
#pragma once

#include <map>
#include <string>

#include "server/gl/program.h"

namespace gonio {

class Programs {
public:
    // Result: the program's GL name. Throws gl::ProgramError, each time, where it does not link.
    GLuint get(std::string_view vertex, std::string_view fragment, const gl::Defines& defines = {});

    gl::VertexArray screen;         // no attributes: the full-screen triangle
    gl::VertexArray solid;          // position and normal, 3 floats each
    gl::Sampler nearest_level;      // one texel of the level asked for
    gl::Buffer seed_directions[2];  // sphere, disk

private:
    std::map<std::string, gl::Program> programs_;
    std::map<std::string, std::string> failures_;  // of those that do not link
};

}  // namespace gonio
