// Names of uploaded files: letters, digits, '.', '_' and '-', no dot in front, with an ending that a scene may have or
// refer to, or a saved show. Such a name is no path.
#pragma once

#include <cctype>
#include <string>
#include <string_view>

namespace gonio {

inline constexpr std::string_view kUploadPrefix = "upload:";  // of load_scene.file, open_show.name
inline constexpr std::size_t kMaxUploadName = 64;

inline bool is_upload_name(std::string_view name) {
    if (name.empty() || name.size() > kMaxUploadName || name.front() == '.') return false;
    std::string ending;
    for (const char c : name) {
        const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
        if (!letter && c != '.' && c != '_' && c != '-') return false;
        if (c == '.') ending.clear();
        ending += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
    return ending == ".glb" || ending == ".gltf" || ending == ".mvr" || ending == ".ies" || ending == ".ldt" ||
           ending == ".json";
}

}  // namespace gonio
