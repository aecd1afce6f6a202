#include "protocol/text/text_bytes.h"

#include <algorithm>

namespace gonio {

std::size_t utf8_length(Bytes bytes, std::size_t at) {
    const auto in = [&](std::size_t i, unsigned low, unsigned high) {
        return at + i < bytes.size() && bytes[at + i] >= low && bytes[at + i] <= high;
    };
    const unsigned b = bytes[at];
    if (b < 0x80) return 1;
    if (b >= 0xC2 && b <= 0xDF) return in(1, 0x80, 0xBF) ? 2 : 0;
    if (b >= 0xE0 && b <= 0xEF) {
        const bool second = in(1, b == 0xE0 ? 0xA0 : 0x80, b == 0xED ? 0x9F : 0xBF);
        return second && in(2, 0x80, 0xBF) ? 3 : 0;
    }
    if (b >= 0xF0 && b <= 0xF4) {
        const bool second = in(1, b == 0xF0 ? 0x90 : 0x80, b == 0xF4 ? 0x8F : 0xBF);
        return second && in(2, 0x80, 0xBF) && in(3, 0x80, 0xBF) ? 4 : 0;
    }
    return 0;
}

std::size_t unseen_length(Bytes bytes, std::size_t at) {
    const unsigned b = bytes[at];
    if (b < 0x20 || b == 0x7F) return 1;
    const auto is = [&](std::size_t i, unsigned low, unsigned high) {
        return at + i < bytes.size() && bytes[at + i] >= low && bytes[at + i] <= high;
    };
    if (b == 0xC2) return is(1, 0x80, 0x9F) ? 2 : 0;  // C1
    if (b != 0xE2) return 0;
    return (is(1, 0x80, 0x80) && is(2, 0xA8, 0xAE)) ||       // U+2028 … 202E
                   (is(1, 0x81, 0x81) && is(2, 0xA6, 0xA9))  // U+2066 … 2069
               ? 3
               : 0;
}

std::string shown_text(std::string_view text, std::size_t most) {
    std::string result(text.substr(0, most));
    for (char& c : result)
        if (c < 0x20 || c > 0x7E) c = '?';
    return result;
}

std::string shortened_text(std::string_view text, std::size_t most) {
    std::size_t end = std::min(text.size(), most);
    // UTF-8 continuation bytes are 10xxxxxx.
    while (end > 0 && end < text.size() && (static_cast<unsigned char>(text[end]) & 0xC0u) == 0x80u) --end;
    return printable_text({reinterpret_cast<const std::uint8_t*>(text.data()), end});
}

std::string printable_text(Bytes bytes) {
    std::string text;
    for (std::size_t at = 0; at < bytes.size() && bytes[at] != 0;) {
        const std::size_t length = utf8_length(bytes, at), unseen = unseen_length(bytes, at);
        if (length == 0 || unseen > 0) {
            text += '?';
            at += std::max<std::size_t>(unseen, 1);
            continue;
        }
        for (std::size_t i = 0; i < length; ++i) text += static_cast<char>(bytes[at + i]);
        at += length;
    }
    return text;
}

}  // namespace gonio
