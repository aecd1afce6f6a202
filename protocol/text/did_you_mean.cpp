#include "protocol/text/did_you_mean.h"

#include <algorithm>
#include <cctype>
#include <numeric>
#include <vector>

namespace gonio {
namespace {

constexpr std::size_t kLongest = 64;  // of a word that is worth comparing, bytes

// Levenshtein's distance.
std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (const char letter : a) {
        std::size_t diagonal = row[0]++;
        for (std::size_t j = 0; j < b.size(); ++j) {
            const std::size_t replaced = diagonal + (letter == b[j] ? 0 : 1);
            diagonal = row[j + 1];
            row[j + 1] = std::min({replaced, diagonal + 1, row[j] + 1});
        }
    }
    return row[b.size()];
}

// Result: without the dashes in front, in small letters.
std::string letters_of(std::string_view word) {
    std::string letters(word.substr(std::min(word.size(), word.find_first_not_of('-'))));
    for (char& c : letters) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return letters;
}

}  // namespace

std::string did_you_mean(std::string_view word, std::span<const std::string_view> known) {
    if (word.size() > kLongest) return {};
    const std::string letters = letters_of(word);
    constexpr std::size_t kMostWrong = 2, kBegins = kMostWrong;
    std::size_t nearest = kMostWrong + 1;
    std::string_view best;
    for (const std::string_view name : known) {
        if (name.size() > kLongest || name == word) continue;
        const std::string other = letters_of(name);
        const auto [shorter, longer] = std::minmax({letters.size(), other.size()});
        const bool begins = letters.size() > 2 && other.starts_with(letters);
        if (longer - shorter > kMostWrong && !begins) continue;
        const std::size_t wrong = edit_distance(letters, other), distance = begins ? std::min(wrong, kBegins) : wrong;
        if (distance >= nearest || distance >= shorter) continue;
        nearest = distance;
        best = name;
    }
    return best.empty() ? "" : " Did you mean " + std::string(best) + "?";
}

std::string with_hint(std::string sentence, std::string_view word, std::span<const std::string_view> known) {
    const std::string hint = did_you_mean(word, known);
    return hint.empty() ? sentence : sentence + "." + hint;
}

}  // namespace gonio
