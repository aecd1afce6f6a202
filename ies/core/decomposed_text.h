// Names that look the same though their accents are spelt otherwise: "ü" in one character or as "u" and two dots.
#pragma once

#include <string>
#include <string_view>

namespace gonio {

// text: UTF-8; bytes that are none stay. Result: letters with accents as letter and accents, Unicode's canonical
// decomposition (NFD), of Latin, Greek, Cyrillic, Hebrew, Indic and Japanese letters, and of Korean. Accents of one
// letter stay in their order, and ideographs as they are.
std::string decomposed_text(std::string_view text);

}  // namespace gonio
