// Names of uploaded files: letters, digits, '.', '_' and '-', no dot in front. The ending is one that a scene may have
// or refer to, that of a photometric file, or that of a saved show. Such a name is no path.
#pragma once

#include <algorithm>
#include <array>
#include <cctype>
#include <string>
#include <string_view>

namespace gonio {

inline constexpr std::string_view kUploadPrefix = "upload:";  // of load_scene.file, open_show.name
inline constexpr std::size_t kMaxUploadName = 64;

// LM-63, EULUMDAT, TM-33 (twice), GLDF, and an archive with one of them. Readers decide by content; the endings are for
// lists of files.
inline constexpr std::array<std::string_view, 6> kPhotometryEndings = {".ies",    ".ldt",  ".xml",
                                                                       ".iesxml", ".gldf", ".zip"};

// Result: what follows the last dot, with it, in lower case; "" without a dot.
inline std::string ending_of(std::string_view name) {
    const std::size_t dot = name.rfind('.');
    std::string ending(dot == std::string_view::npos ? std::string_view() : name.substr(dot));
    for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return ending;
}

inline bool is_photometry_name(std::string_view name) {
    return std::ranges::find(kPhotometryEndings, ending_of(name)) != kPhotometryEndings.end();
}

inline bool is_upload_name(std::string_view name) {
    if (name.empty() || name.size() > kMaxUploadName || name.front() == '.') return false;
    for (const char c : name) {
        const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
        if (!letter && c != '.' && c != '_' && c != '-') return false;
    }
    const std::string ending = ending_of(name);
    return ending == ".glb" || ending == ".gltf" || ending == ".mvr" || ending == ".json" || is_photometry_name(name);
}

}  // namespace gonio
