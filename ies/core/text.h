// Text from outside: what of it is UTF-8, and what of it errors show.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace gonio {

// Result: the length of the well-formed UTF-8 sequence at `at`, 1 to 4, or 0 (Unicode 15, table 3-7).
inline std::size_t utf8_length(std::string_view text, std::size_t at) {
    const auto in = [&](std::size_t i, unsigned low, unsigned high) {
        if (at + i >= text.size()) return false;
        const auto byte = static_cast<unsigned char>(text[at + i]);
        return byte >= low && byte <= high;
    };
    if (in(0, 0x00, 0x7F)) return 1;
    if (in(0, 0xC2, 0xDF)) return in(1, 0x80, 0xBF) ? 2 : 0;
    const unsigned b = static_cast<unsigned char>(text[at]);
    if (in(0, 0xE0, 0xEF)) {
        const bool second = in(1, b == 0xE0 ? 0xA0 : 0x80, b == 0xED ? 0x9F : 0xBF);
        return second && in(2, 0x80, 0xBF) ? 3 : 0;
    }
    if (in(0, 0xF0, 0xF4)) {
        const bool second = in(1, b == 0xF0 ? 0x90 : 0x80, b == 0xF4 ? 0x8F : 0xBF);
        return second && in(2, 0x80, 0xBF) && in(3, 0x80, 0xBF) ? 4 : 0;
    }
    return 0;
}

// Result: the first `most` bytes as printable ASCII, others replaced by '?': for the offending values of errors.
inline std::string shown_text(std::string_view text, std::size_t most = 32) {
    std::string result(text.substr(0, most));
    for (char& c : result)
        if (c < ' ' || c > '~') c = '?';
    return result;
}

}  // namespace gonio
