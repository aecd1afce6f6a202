#include "ies/core/decomposed_text.h"

#include <cstddef>
#include <cstdint>

#include "ies/core/unicode_letters.h"

namespace gonio {
namespace {

// Result: the letter's row in the table, nullptr where it has none.
const std::uint16_t* row_of(std::uint32_t letter) {
    std::size_t first = 0, last = kDecompositions.size() / 3;
    while (first < last) {
        const std::size_t middle = (first + last) / 2;
        if (kDecompositions[3 * middle] < letter)
            first = middle + 1;
        else
            last = middle;
    }
    const bool found = 3 * first < kDecompositions.size() && kDecompositions[3 * first] == letter;
    return found ? &kDecompositions[3 * first] : nullptr;
}

void add_utf8(std::string& text, std::uint32_t letter) {
    const auto byte = [&](std::uint32_t value) { text += static_cast<char>(value); };
    if (letter < 0x80) return byte(letter);
    if (letter < 0x800) {
        byte(0xC0 | letter >> 6);
    } else {
        byte(0xE0 | letter >> 12);
        byte(0x80 | (letter >> 6 & 0x3F));
    }
    byte(0x80 | (letter & 0x3F));
}

void add_decomposed(std::string& text, std::uint32_t letter) {
    constexpr std::uint32_t kFirstSyllable = 0xAC00, kLead = 0x1100, kVowel = 0x1161, kTail = 0x11A7, kVowels = 21,
                            kTails = 28, kSyllables = 11'172;  // The Unicode Standard, 3.12
    if (const std::uint32_t syllable = letter - kFirstSyllable; letter >= kFirstSyllable && syllable < kSyllables) {
        add_utf8(text, kLead + syllable / (kVowels * kTails));
        add_utf8(text, kVowel + syllable % (kVowels * kTails) / kTails);
        if (syllable % kTails != 0) add_utf8(text, kTail + syllable % kTails);
        return;
    }
    const std::uint16_t* const row = row_of(letter);
    if (row == nullptr) return add_utf8(text, letter);
    add_decomposed(text, row[1]);
    add_decomposed(text, row[2]);
}

}  // namespace

std::string decomposed_text(std::string_view text) {
    std::string result;
    for (std::size_t at = 0; at < text.size();) {
        const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[at + i]); };
        const auto follows = [&](std::size_t i) { return at + i < text.size() && (byte(i) & 0xC0u) == 0x80u; };
        if ((byte(0) & 0xE0u) == 0xC0u && follows(1)) {
            add_decomposed(result, (byte(0) & 0x1Fu) << 6 | (byte(1) & 0x3Fu));
            at += 2;
        } else if ((byte(0) & 0xF0u) == 0xE0u && follows(1) && follows(2)) {
            add_decomposed(result, (byte(0) & 0x0Fu) << 12 | (byte(1) & 0x3Fu) << 6 | (byte(2) & 0x3Fu));
            at += 3;
        } else {
            result += text[at++];
        }
    }
    return result;
}

}  // namespace gonio
