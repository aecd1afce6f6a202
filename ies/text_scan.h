// Reading untrusted text: places for messages, lines of any ending, and one stream of numbers.
// Internal to ies/. Nothing here allocates more than its input.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "ies/core/result.h"
#include "ies/photometry.h"

namespace gonio::ies::detail {

// Result: an Error with "line L column C", both from 1, columns in bytes; CR, LF and CRLF each end one line. Linear in
// offset. value: cut to 80 bytes, unprintable bytes as '?'.
Error error_at(std::string_view text, std::size_t offset, std::string code, std::string_view value,
               std::string message);

// Collects diagnostics, one per code (the first place), so that no file can make the list long.
class Report {
public:
    explicit Report(std::string_view text) : text_(text) {}
    void warn(std::string_view code, std::size_t offset, std::string message) {
        add(code, "warning", offset, std::move(message));
    }
    void note(std::string_view code, std::size_t offset, std::string message) {
        add(code, "note", offset, std::move(message));
    }
    std::vector<Diagnostic> take() { return std::move(list_); }

private:
    void add(std::string_view code, std::string_view severity, std::size_t offset, std::string message);
    std::string_view text_;
    std::vector<Diagnostic> list_;
};

// Result: the line that starts at `at` without its ending; `at` moves to the next line (text.size() after the last).
std::string_view take_line(std::string_view text, std::size_t& at);

std::string_view trim(std::string_view text);  // without blanks, tabs, line ends and NULs at both ends
std::string to_upper(std::string_view text);   // ASCII only
bool is_separator(char c);                     // white space, comma, semicolon

enum class NumberStatus { ok, end, not_a_number, not_finite };

// Result: why there is no number at offset. what: its name; kind: "a number", what must stand there.
Error number_error(std::string_view text, std::size_t offset, NumberStatus status, std::string_view token,
                   std::string_view what, std::string_view kind);

// Numbers separated by white space, commas or semicolons. Accepts "+1", ".5", "5.", "1E3" and Fortran's "1D3"; refuses
// "inf", "nan", hexadecimal and glued tokens. Ctrl-Z ends the text.
struct NumberStream {
    std::string_view text;
    std::size_t at = 0;           // next byte
    std::size_t token_begin = 0;  // of the last token that was read
    bool fortran = false;         // a D exponent was met

    NumberStatus next(double& value);
    std::string_view token() const;  // the last token as written
};

}  // namespace gonio::ies::detail
