#include "protocol/text/text_bytes.h"

#include <algorithm>

namespace gonio {

std::size_t unseen_length(std::string_view text, std::size_t at) {
    const auto is = [&](std::size_t i, unsigned low, unsigned high) {
        if (at + i >= text.size()) return false;
        const auto byte = static_cast<unsigned char>(text[at + i]);
        return byte >= low && byte <= high;
    };
    if (is(0, 0x00, 0x1F) || is(0, 0x7F, 0x7F)) return 1;
    if (is(0, 0xC2, 0xC2) && is(1, 0x80, 0x9F)) return 2;  // C1
    if (!is(0, 0xE2, 0xE2)) return 0;
    const bool unseen = (is(1, 0x80, 0x80) && is(2, 0xA8, 0xAE)) ||  // U+2028 … 202E
                        (is(1, 0x81, 0x81) && is(2, 0xA6, 0xA9));    // U+2066 … 2069
    return unseen ? 3 : 0;
}

int hex_digit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

std::string shortened_text(std::string_view text, std::size_t most) {
    std::size_t end = std::min(text.size(), most);
    // UTF-8 continuation bytes are 10xxxxxx.
    while (end > 0 && end < text.size() && (static_cast<unsigned char>(text[end]) & 0xC0u) == 0x80u) --end;
    text = text.substr(0, end);
    std::string result;
    for (std::size_t at = 0; at < text.size() && text[at] != 0;) {
        const std::size_t length = utf8_length(text, at), unseen = unseen_length(text, at);
        const bool shown = length > 0 && unseen == 0;
        result += shown ? text.substr(at, length) : "?";
        at += shown ? length : std::max<std::size_t>(unseen, 1);
    }
    return result;
}

std::string printable_text(Bytes bytes) {
    return shortened_text({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, bytes.size());
}

}  // namespace gonio
