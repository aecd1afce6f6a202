#include "ies/text_encoding.h"

#include <array>

#include "ies/core/text.h"

namespace gonio::ies::detail {

namespace {

constexpr unsigned kReplacement = 0xfffd;

// Code points of 0x80..0x9f in Windows-1252; from 0xa0 on it is Latin-1, whose code points are its bytes.
constexpr std::array<unsigned, 32> kWindows1252 = {
    0x20ac, 0xfffd, 0x201a, 0x0192, 0x201e, 0x2026, 0x2020, 0x2021, 0x02c6, 0x2030, 0x0160,
    0x2039, 0x0152, 0xfffd, 0x017d, 0xfffd, 0xfffd, 0x2018, 0x2019, 0x201c, 0x201d, 0x2022,
    0x2013, 0x2014, 0x02dc, 0x2122, 0x0161, 0x203a, 0x0153, 0xfffd, 0x017e, 0x0178,
};

// Code points of 0x80..0xff in code page 850.
constexpr std::array<unsigned, 128> kCodePage850 = {
    0x00c7, 0x00fc, 0x00e9, 0x00e2, 0x00e4, 0x00e0, 0x00e5, 0x00e7, 0x00ea, 0x00eb, 0x00e8, 0x00ef, 0x00ee,
    0x00ec, 0x00c4, 0x00c5, 0x00c9, 0x00e6, 0x00c6, 0x00f4, 0x00f6, 0x00f2, 0x00fb, 0x00f9, 0x00ff, 0x00d6,
    0x00dc, 0x00f8, 0x00a3, 0x00d8, 0x00d7, 0x0192, 0x00e1, 0x00ed, 0x00f3, 0x00fa, 0x00f1, 0x00d1, 0x00aa,
    0x00ba, 0x00bf, 0x00ae, 0x00ac, 0x00bd, 0x00bc, 0x00a1, 0x00ab, 0x00bb, 0x2591, 0x2592, 0x2593, 0x2502,
    0x2524, 0x00c1, 0x00c2, 0x00c0, 0x00a9, 0x2563, 0x2551, 0x2557, 0x255d, 0x00a2, 0x00a5, 0x2510, 0x2514,
    0x2534, 0x252c, 0x251c, 0x2500, 0x253c, 0x00e3, 0x00c3, 0x255a, 0x2554, 0x2569, 0x2566, 0x2560, 0x2550,
    0x256c, 0x00a4, 0x00f0, 0x00d0, 0x00ca, 0x00cb, 0x00c8, 0x0131, 0x00cd, 0x00ce, 0x00cf, 0x2518, 0x250c,
    0x2588, 0x2584, 0x00a6, 0x00cc, 0x2580, 0x00d3, 0x00df, 0x00d4, 0x00d2, 0x00f5, 0x00d5, 0x00b5, 0x00fe,
    0x00de, 0x00da, 0x00db, 0x00d9, 0x00fd, 0x00dd, 0x00af, 0x00b4, 0x00ad, 0x00b1, 0x2017, 0x00be, 0x00b6,
    0x00a7, 0x00f7, 0x00b8, 0x00b0, 0x00a8, 0x00b7, 0x00b9, 0x00b3, 0x00b2, 0x25a0, 0x00a0,
};

void append(std::string& result, unsigned code) {
    const auto put = [&](unsigned value) { result.push_back(static_cast<char>(value)); };
    if (code < 0x80) {
        put(code);
    } else if (code < 0x800) {
        put(0xc0 | code >> 6);
        put(0x80 | (code & 0x3f));
    } else if (code < 0x10000) {
        put(0xe0 | code >> 12);
        put(0x80 | (code >> 6 & 0x3f));
        put(0x80 | (code & 0x3f));
    } else {
        put(0xf0 | code >> 18);
        put(0x80 | (code >> 12 & 0x3f));
        put(0x80 | (code >> 6 & 0x3f));
        put(0x80 | (code & 0x3f));
    }
}

}  // namespace

Encoding guess_encoding(std::string_view text) {
    bool utf8 = true;
    std::size_t dos_letters = 0;
    std::size_t latin_letters = 0;
    for (std::size_t i = 0; i < text.size();) {
        const unsigned byte = static_cast<unsigned char>(text[i]);
        if (byte < 0x80) {
            ++i;
            continue;
        }
        const std::size_t length = utf8 ? utf8_length(text, i) : 0;
        utf8 = utf8 && length != 0;
        // 0x80..0xa5 are letters in code page 850 and rare signs in Windows-1252; 0xc0.. the other way round.
        if (byte <= 0xa5) ++dos_letters;
        if (byte >= 0xc0) ++latin_letters;
        i += length == 0 ? 1 : length;
    }
    if (utf8) return Encoding::utf8;
    return dos_letters > latin_letters ? Encoding::code_page_850 : Encoding::windows_1252;
}

std::string to_utf8(std::string_view text, Encoding encoding) {
    std::string result;
    result.reserve(text.size());
    for (std::size_t i = 0; i < text.size();) {
        const unsigned byte = static_cast<unsigned char>(text[i]);
        if (byte < 0x80) {
            result.push_back(byte == 0 ? ' ' : static_cast<char>(byte));
            ++i;
        } else if (encoding == Encoding::utf8) {
            const std::size_t length = utf8_length(text, i);
            if (length == 0) append(result, kReplacement);
            result.append(text.substr(i, length));
            i += length == 0 ? 1 : length;
        } else {
            append(result, encoding == Encoding::code_page_850 ? kCodePage850[byte - 0x80]
                           : byte < 0xa0                       ? kWindows1252[byte - 0x80]
                                                               : byte);
            ++i;
        }
    }
    return result;
}

std::string decode_utf16(std::string_view bytes) {
    if (bytes.size() < 2) return {};
    const auto byte = [&](std::size_t i) { return static_cast<unsigned>(static_cast<unsigned char>(bytes[i])); };
    const unsigned mark = byte(0) << 8 | byte(1);
    if (mark != 0xfffe && mark != 0xfeff) return {};
    const std::size_t high = mark == 0xfeff ? 0 : 1;
    const auto unit = [&](std::size_t i) { return byte(i + high) << 8 | byte(i + 1 - high); };
    std::string result;
    result.reserve(bytes.size() / 2 + 16);
    for (std::size_t i = 2; i + 1 < bytes.size(); i += 2) {
        unsigned code = unit(i);
        if (code >= 0xd800 && code < 0xe000) {
            const unsigned low = code < 0xdc00 && i + 3 < bytes.size() ? unit(i + 2) : 0;
            const bool pair = low >= 0xdc00 && low < 0xe000;
            code = pair ? 0x10000 + ((code - 0xd800) << 10) + (low - 0xdc00) : kReplacement;
            if (pair) i += 2;
        }
        append(result, code);
    }
    return result;
}

std::string_view without_mark(std::string_view text) {
    constexpr std::string_view kUtf8Mark = "\xef\xbb\xbf";
    if (text.substr(0, kUtf8Mark.size()) == kUtf8Mark) text.remove_prefix(kUtf8Mark.size());
    return text;
}

}  // namespace gonio::ies::detail
