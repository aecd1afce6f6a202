#include "server/render/programs.h"

namespace gonio {

GLuint Programs::get(std::string_view vertex, std::string_view fragment, const gl::Defines& defines) {
    std::string key = std::string(vertex) + "|" + std::string(fragment);
    for (const auto& [name, value] : defines) key += "|" + name + "=" + value;
    const auto at = programs_.find(key);
    if (at != programs_.end()) return at->second.id();
    if (const auto failed = failures_.find(key); failed != failures_.end()) throw gl::ProgramError(failed->second);
    try {
        return programs_.emplace(key, gl::make_program(vertex, fragment, defines)).first->second.id();
    } catch (const gl::ProgramError& error) {
        failures_.emplace(std::move(key), error.what());
        throw;
    }
}

}  // namespace gonio
