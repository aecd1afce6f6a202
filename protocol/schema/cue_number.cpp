#include "protocol/schema/cue_number.h"

#include <algorithm>

namespace gonio {

std::optional<std::uint32_t> parse_cue_number(std::string_view text) {
    const std::size_t dot = std::min(text.find('.'), text.size());
    const std::string_view whole = text.substr(0, dot), part = text.substr(std::min(dot + 1, text.size()));
    const auto digits = [](std::string_view word) {
        return std::ranges::all_of(word, [](char c) { return c >= '0' && c <= '9'; });
    };
    if (whole.size() > 4 || part.size() > 3 || !digits(whole) || !digits(part)) return std::nullopt;
    if (whole.empty() && part.empty()) return std::nullopt;
    std::uint32_t thousandths = 0;
    for (const char c : whole) thousandths = thousandths * 10 + static_cast<std::uint32_t>(c - '0');
    for (std::size_t i = 0; i < 3; ++i)
        thousandths = thousandths * 10 + (i < part.size() ? static_cast<std::uint32_t>(part[i] - '0') : 0);
    return thousandths == 0 ? std::nullopt : std::optional(thousandths);
}

std::string print_cue_number(std::uint32_t thousandths) {
    if (thousandths == 0) return {};
    std::string text = std::to_string(thousandths / 1000);
    std::string part = std::to_string(1000 + thousandths % 1000).substr(1);
    while (part.ends_with('0')) part.pop_back();
    return part.empty() ? text : text + "." + part;
}

}  // namespace gonio
