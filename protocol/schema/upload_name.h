// Names of uploaded files. Such a name is no path.
#pragma once

#include <algorithm>
#include <array>
#include <cctype>
#include <string>
#include <string_view>

namespace gonio {

inline constexpr std::string_view kUploadPrefix = "upload:";  // of load_scene.file, open_show.name
inline constexpr std::size_t kMaxUploadName =
    120;  // bytes: with the prefix it is a name of at most 128 (kMaxNameBytes)

// LM-63, EULUMDAT, TM-33 (twice), GLDF, GDTF, and an archive with one of the others. Readers of photometry decide by
// content; the endings are for lists of files.
inline constexpr std::array<std::string_view, 7> kPhotometryEndings = {".ies",  ".ldt",  ".xml", ".iesxml",
                                                                       ".gldf", ".gdtf", ".zip"};

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

// Result: whether an upload may have this name. It is UTF-8 of at most kMaxUploadName bytes without control characters,
// '/', '\\' and '"'. No dot is in front, and no blank at either end. Its ending is one that a scene may have or refer
// to, that of a photometric file, or that of a saved show.
bool is_upload_name(std::string_view name);
// What a refusal says of another name.
inline constexpr std::string_view kUploadNameRule =
    "must be UTF-8 of at most 120 bytes without / \\ and \", that begins with no dot or blank and ends in .glb, .gltf, "
    ".mvr, .json, .ies, .ldt, .xml, .iesxml, .gldf, .gdtf or .zip";

}  // namespace gonio
