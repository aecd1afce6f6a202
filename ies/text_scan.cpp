#include "ies/text_scan.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "ies/core/text.h"

namespace gonio::ies::detail {

namespace {

constexpr char kCtrlZ = '\x1a';

constexpr std::array<bool, 256> separator_table() {
    std::array<bool, 256> table{};
    for (const char c : {' ', '\t', '\r', '\n', '\v', '\f', ',', ';'}) table[static_cast<unsigned char>(c)] = true;
    return table;
}
constexpr std::array<bool, 256> kSeparator = separator_table();

constexpr bool is_blank(char c) {
    return c == ' ' || (c >= '\t' && c <= '\r') || c == '\0';
}

// The tokens that std::from_chars does not take: a leading plus and Fortran's D exponent; and those that it reports as
// out of range, which are zero where they underflow.
NumberStatus parse_unusual(std::string_view token, double& value, bool& fortran) {
    const bool plus = token.front() == '+';
    std::string copy(plus ? token.substr(1) : token);
    if (copy.empty() || (plus && copy[0] == '-')) return NumberStatus::not_a_number;
    const std::size_t digit = copy.find_first_not_of("-.");
    if (digit == std::string::npos || copy[digit] < '0' || copy[digit] > '9') {
        const std::string upper = to_upper(copy[0] == '-' ? copy.substr(1) : copy);
        const bool non_finite = upper == "INF" || upper == "INFINITY" || upper.rfind("NAN", 0) == 0;
        return non_finite ? NumberStatus::not_finite : NumberStatus::not_a_number;
    }
    const std::size_t d = copy.find_first_of("dD");
    if (d != std::string::npos) copy[d] = 'e';
    const auto [end, status] = std::from_chars(copy.data(), copy.data() + copy.size(), value);
    if (end != copy.data() + copy.size()) return NumberStatus::not_a_number;
    if (status == std::errc::result_out_of_range) {
        const std::size_t exponent = copy.find_first_of("eE");
        const bool underflow = exponent == std::string::npos ? copy.find_first_not_of("-0.") > copy.find('.')
                                                             : exponent + 1 < copy.size() && copy[exponent + 1] == '-';
        if (!underflow) return NumberStatus::not_finite;
        value = 0.0;
    } else if (status != std::errc{}) {
        return NumberStatus::not_a_number;
    }
    if (d != std::string::npos) fortran = true;
    return std::isfinite(value) ? NumberStatus::ok : NumberStatus::not_finite;
}

struct Place {
    int line = 1;
    int column = 1;
};

Place place_of(std::string_view text, std::size_t offset) {
    Place place;
    const std::size_t end = std::min(offset, text.size());
    for (std::size_t i = 0; i < end; ++i) {
        const bool crlf_half = text[i] == '\r' && i + 1 < text.size() && text[i + 1] == '\n';
        if ((text[i] == '\n' || text[i] == '\r') && !crlf_half) {
            ++place.line;
            place.column = 1;
        } else {
            ++place.column;
        }
    }
    return place;
}

}  // namespace

Error error_at(std::string_view text, std::size_t offset, std::string code, std::string_view value,
               std::string message) {
    constexpr std::size_t kShownBytes = 80;
    const Place place = place_of(text, offset);
    return {std::move(code), "line " + std::to_string(place.line) + " column " + std::to_string(place.column),
            shown_text(value, kShownBytes), std::move(message)};
}

Error number_error(std::string_view text, std::size_t offset, NumberStatus status, std::string_view token,
                   std::string_view what, std::string_view kind) {
    const std::string name = "the " + std::string(what);
    if (status == NumberStatus::end) return error_at(text, offset, "truncated", {}, "the file ends before " + name);
    if (status == NumberStatus::not_finite)
        return error_at(text, offset, "not_finite", token, name + " is not a finite number");
    return error_at(text, offset, "not_a_number", token, name + " is not " + std::string(kind));
}

void Report::add(std::string_view code, std::string_view severity, std::size_t offset, std::string message) {
    for (const Diagnostic& known : list_) {
        if (known.code == code) return;
    }
    const Place place = place_of(text_, offset);
    list_.push_back({std::string(code), std::string(severity), place.line, place.column, std::move(message)});
}

std::string_view take_line(std::string_view text, std::size_t& at) {
    const std::size_t begin = at;
    std::size_t end = begin;
    while (end < text.size() && text[end] != '\n' && text[end] != '\r') ++end;
    if (end >= text.size()) {
        at = text.size();
        return text.substr(begin);
    }
    at = end + (text[end] == '\r' && end + 1 < text.size() && text[end + 1] == '\n' ? 2 : 1);
    return text.substr(begin, end - begin);
}

std::string_view trim(std::string_view text) {
    while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
    while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
    return text;
}

std::string to_upper(std::string_view text) {
    std::string result(text);
    for (char& c : result) {
        if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
    }
    return result;
}

bool is_separator(char c) {
    return kSeparator[static_cast<unsigned char>(c)];
}

NumberStatus NumberStream::next(double& value) {
    const char* const end = text.data() + text.size();
    const char* p = text.data() + at;
    while (p != end && is_separator(*p)) ++p;
    token_begin = static_cast<std::size_t>(p - text.data());
    at = token_begin;
    if (p == end || *p == kCtrlZ) return NumberStatus::end;
    // The usual token: from_chars takes it whole. "inf", "nan" and the rest go the slow way.
    const char first = *p == '-' && p + 1 != end ? p[1] : *p;
    if ((first >= '0' && first <= '9') || first == '.') {
        const auto [stop, status] = std::from_chars(p, end, value);
        if (status == std::errc{} && (stop == end || is_separator(*stop) || *stop == kCtrlZ)) {
            at = static_cast<std::size_t>(stop - text.data());
            return std::isfinite(value) ? NumberStatus::ok : NumberStatus::not_finite;
        }
    }
    const std::string_view whole = token();
    at = token_begin + whole.size();
    // A number has no more digits than any writer prints; this also keeps refused binary data cheap.
    constexpr std::size_t kMaxTokenBytes = 1024;
    if (whole.size() > kMaxTokenBytes) return NumberStatus::not_a_number;
    return parse_unusual(whole, value, fortran);
}

std::string_view NumberStream::token() const {
    std::size_t end = token_begin;
    while (end < text.size() && !is_separator(text[end]) && text[end] != kCtrlZ) ++end;
    return text.substr(token_begin, end - token_begin);
}

}  // namespace gonio::ies::detail
