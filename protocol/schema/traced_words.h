// Options that all commands have whose answer is path-traced where it is asked for.
#pragma once

#include <array>

#include "protocol/schema/word_table.h"

namespace gonio {

inline constexpr WordRow kTracedOptions[] = {
    {"--bounces", "N", WordForm::text, "bounces", "all (default), 0 or 1; reference: up to 64"},
    {"--noise", "R", WordForm::ratio, "noise_ratio",
     "reference: ends at this standard error, 0.0005 to 0.5 of the total; default 0.005"},
    {"--max-seconds", "S", WordForm::number, "max_seconds",
     "reference: ends then with what it has, 0.1 to 86400; default: no end"},
    {"--openings", "", WordForm::flag, "openings",
     "has no effect: luminaires always emit from their luminous openings"},
};

// Result: the rows, one part after the other.
template <std::size_t... sizes>
constexpr std::array<WordRow, (sizes + ...)> joined(const WordRow (&... parts)[sizes]) {
    std::array<WordRow, (sizes + ...)> rows{};
    std::size_t at = 0;
    const auto add = [&](const auto& part) {
        for (const WordRow& row : part) rows[at++] = row;
    };
    (add(parts), ...);
    return rows;
}

}  // namespace gonio
