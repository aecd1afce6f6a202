// A hint for a word that is misspelt.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace gonio {

// Result: " Did you mean X?" with the nearest of the known words. It differs from `word` in at most two letters or by
// capitals, or begins with it. Dashes in front count for nothing. Empty: none is near, or the word has more than 64
// bytes. Takes a microsecond for each known word.
std::string did_you_mean(std::string_view word, std::span<const std::string_view> known);
// Result: a sentence without its full stop, with the hint behind it where there is one.
std::string with_hint(std::string sentence, std::string_view word, std::span<const std::string_view> known);

}  // namespace gonio
