#include "ies/lm63_header.h"

#include <array>
#include <charconv>

namespace gonio::ies::detail {

namespace {

constexpr std::size_t kMaxKeywords = 10'000;  // no file needs more; bounds memory to a multiple of the file's size

struct Version {
    int year = 0;  // the rules to use; 0 if the line is no version line
    bool exact = false;
    bool unknown_year = false;
};

// "IESNA:LM-63-2002" and its relatives, in any case and spacing. A year that no standard has gets the rules of the
// nearest one before it; later ones those of 2019.
Version parse_version(std::string_view line) {
    std::string compact;
    for (const char c : to_upper(trim(line).substr(0, 64))) {
        if (c != ' ' && c != '\t') compact.push_back(c);
    }
    const std::string_view trimmed = trim(line);
    if (compact.rfind("IESNA91", 0) == 0) return {1991, trimmed == "IESNA91", false};
    for (const std::string_view prefix : {"IESNA:LM-63-", "IES:LM-63-", "IESNALM-63-", "IESNA:LM63-", "IES:LM63-"}) {
        if (compact.rfind(prefix, 0) != 0) continue;
        int year = 0;
        const char* const begin = compact.data() + prefix.size();
        const char* const end = compact.data() + compact.size();
        const auto [stop, status] = std::from_chars(begin, end, year);
        if (status != std::errc{}) return {};
        if (year >= 0 && year < 100) year += year < 80 ? 2000 : 1900;
        const bool exact =
            trimmed == "IESNA:LM-63-1995" || trimmed == "IESNA:LM-63-2002" || trimmed == "IES:LM-63-2019";
        constexpr std::array kYears = {2019, 2002, 1995, 1991, 1986};
        for (const int known : kYears) {
            if (year >= known) return {known, exact, year != known};
        }
        return {1986, false, true};
    }
    return {};
}

// If the line is a TILT line: the text after '='. spelled_exactly: "TILT=" at the line's first byte.
std::optional<std::string_view> tilt_value(std::string_view line, bool& spelled_exactly) {
    const std::string_view trimmed = trim(line);
    if (to_upper(trimmed.substr(0, 4)) != "TILT") return std::nullopt;
    const std::string_view rest = trim(trimmed.substr(4));
    if (rest.empty() || rest.front() != '=') return std::nullopt;
    spelled_exactly = line.substr(0, 5) == "TILT=" && (line.size() == 5 || line[5] != ' ');
    return trim(rest.substr(1));
}

void read_tilt(std::string_view text, std::size_t line_begin, std::string_view value, bool exact, Lm63Header& header,
               Report& report) {
    std::size_t word_end = 0;
    while (word_end < value.size() && !is_separator(value[word_end])) ++word_end;
    const std::string_view word = value.substr(0, word_end);
    const std::string upper = to_upper(word);
    if (upper == "NONE" || upper == "INCLUDE") {
        header.tilt = upper == "NONE" ? TiltKind::none : TiltKind::include;
        header.body_offset = static_cast<std::size_t>(word.data() + word.size() - text.data());
        if (!exact || upper != word) {
            report.warn("tilt_spelling", line_begin, "the TILT line is not spelled as the standard has it");
        }
        return;
    }
    header.tilt = TiltKind::file;
    report.warn("tilt_file", line_begin,
                "TILT names another file, which is never opened; the candela are taken as they stand");
}

struct KeywordLine {
    std::string_view key;  // empty for a label line
    std::string_view value;
};

KeywordLine split_keyword(std::string_view line) {
    const std::string_view trimmed = trim(line);
    const std::size_t close = trimmed.find(']');
    if (trimmed.empty() || trimmed.front() != '[' || close == std::string_view::npos) return {{}, trimmed};
    return {trim(trimmed.substr(1, close - 1)), trim(trimmed.substr(close + 1))};
}

void check_line_length(std::string_view line, std::size_t offset, int year, Report& report) {
    // LM-63-1991 and -1995: label lines of 80 characters; LM-63-2002 clause 5.2: 256 with CR and LF; 2019: no limit.
    constexpr std::size_t kLabelBytes = 80;
    constexpr std::size_t kLineBytes = 254;
    if (year >= 2019) return;
    if (line.size() > kLineBytes) {
        report.warn("long_line", offset, "a header line is longer than any version before 2019 allows");
    } else if (year < 2002 && line.size() > kLabelBytes) {
        report.note("long_label", offset, "a header line is longer than the 80 characters of its version");
    }
}

void report_missing_keywords(const Lm63Header& header, Report& report) {
    if (header.year < 2002) return;
    for (const std::string_view required : {"TEST", "TESTLAB", "ISSUEDATE", "MANUFAC"}) {
        bool found = false;
        for (const auto& [key, value] : header.keywords) found = found || key == required;
        if (!found)
            report.note("missing_keyword", 0, "the required keyword [" + std::string(required) + "] is missing");
    }
}

}  // namespace

bool starts_with_lm63_version(std::string_view text) {
    std::size_t at = 0;
    while (at < text.size()) {
        const std::string_view line = take_line(text, at);
        if (!trim(line).empty()) return parse_version(line).year != 0;
    }
    return false;
}

Result<Lm63Header> read_lm63_header(std::string_view text, Report& report) {
    Lm63Header header;
    bool version_seen = false;
    bool in_keyword = false;
    std::size_t at = 0;
    while (at < text.size()) {
        const std::size_t begin = at;
        const std::string_view line = take_line(text, at);
        if (trim(line).empty()) continue;
        if (!version_seen) {
            version_seen = true;
            const Version version = parse_version(line);
            if (version.year != 0) {
                header.year = version.year;
                if (version.unknown_year) {
                    report.warn("unknown_version", begin,
                                "no such version of LM-63; the nearest one's rules were used");
                } else if (!version.exact) {
                    report.warn("version_spelling", begin, "the version line is not spelled as the standard has it");
                }
                continue;
            }
            report.note("no_version", begin, "no version line: read as LM-63-1986");
        }
        bool exact = false;
        if (const auto value = tilt_value(line, exact)) {
            header.body_offset = at;
            read_tilt(text, begin, *value, exact, header, report);
            report_missing_keywords(header, report);
            return header;
        }
        check_line_length(line, begin, header.year, report);
        const KeywordLine entry = split_keyword(line);
        const std::string key = to_upper(entry.key);
        if (key == "MORE" && in_keyword) {
            std::string& value = header.keywords.back().second;
            if (!value.empty()) value += '\n';
            value += entry.value;
            continue;
        }
        if (header.keywords.size() >= kMaxKeywords) {
            report.warn("too_many_keywords", begin, "keywords beyond the first 10000 are dropped");
            continue;
        }
        if (entry.key.empty() && header.year >= 1991) {
            report.note("label_line", begin, "text that belongs to no keyword is kept as a label");
        }
        header.keywords.emplace_back(key, std::string(entry.value));
        in_keyword = !key.empty();
    }
    if (!version_seen) return error_at(text, 0, "empty_file", {}, "the file is empty");
    return error_at(text, text.size(), "no_tilt", {}, "the file has no TILT line: it is no LM-63 file");
}

}  // namespace gonio::ies::detail
