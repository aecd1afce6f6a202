// Names and comments of photometric files come in several 8-bit encodings; Gonio keeps UTF-8. Internal to ies/.
#pragma once

#include <string>
#include <string_view>

namespace gonio::ies::detail {

enum class Encoding { utf8, windows_1252, code_page_850 };

// Result: the likely encoding of a text. It is UTF-8 if the text is well-formed UTF-8, else the page in which its bytes
// are letters. Code page 850 has ä, ö, ü at 0x84, 0x94, 0x81. Latin-1 and Windows-1252 have them at 0xe4, 0xf6, 0xfc.
Encoding guess_encoding(std::string_view text);

// Result: text as UTF-8. Bytes that the page does not define become U+FFFD; NUL becomes a blank.
std::string to_utf8(std::string_view text, Encoding encoding);

// Result: the text as UTF-8 without byte order mark if it starts with a UTF-16 mark, else empty. Lone surrogates become
// U+FFFD.
std::string decode_utf16(std::string_view bytes);

// Result: text without a UTF-8 byte order mark.
std::string_view without_mark(std::string_view text);

}  // namespace gonio::ies::detail
