// The part of an LM-63 file before its numbers: version line, keywords or labels, TILT line. Internal to ies/.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "ies/core/result.h"
#include "ies/text_scan.h"

namespace gonio::ies::detail {

enum class TiltKind { none, include, file };

struct Lm63Header {
    int year = 1986;  // 1986, 1991, 1995, 2002 or 2019: the rules to read the rest by
    std::vector<std::pair<std::string, std::string>> keywords;
    TiltKind tilt = TiltKind::none;
    std::size_t body_offset = 0;  // first byte after "TILT=..."
};

// Result: the header (LM-63-2002 clauses 5.1-5.5), or error empty_file or no_tilt. The TILT line is one that starts
// with TILT; the text "TILT=" inside a keyword's value does not count.
Result<Lm63Header> read_lm63_header(std::string_view text, Report& report);

// Result: whether the first line names an LM-63 version in any spelling that read_lm63_header knows.
bool starts_with_lm63_version(std::string_view text);

}  // namespace gonio::ies::detail
