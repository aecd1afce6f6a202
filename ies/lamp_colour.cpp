#include "ies/lamp_colour.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <string>
#include <string_view>
#include <vector>

#include "ies/text_scan.h"

namespace gonio::ies {

namespace {

constexpr double kLeast_k = 1000.0, kMost_k = 20'000.0;
constexpr std::size_t kMostText_bytes = 200;  // of a text; no colour is told behind that

bool is_digit(char c) {
    return c >= '0' && c <= '9';
}
bool is_letter(char c) {
    return c >= 'A' && c <= 'Z';
}

// A number in a text in upper case, and what stands about it.
struct Found {
    double value = 0.0;
    std::size_t begin = 0, digits = 0;
    char before = ' ';       // the sign next to it
    std::string_view after;  // without blanks
};

std::vector<Found> numbers_in(std::string_view text) {
    std::vector<Found> found;
    for (std::size_t at = 0; at < text.size();) {
        if (!is_digit(text[at])) {
            ++at;
            continue;
        }
        Found one;
        one.begin = at;
        one.before = at > 0 ? text[at - 1] : ' ';
        const auto [end, status] = std::from_chars(text.data() + at, text.data() + text.size(), one.value);
        if (status != std::errc{}) break;
        const auto stop = static_cast<std::size_t>(end - text.data());
        while (at + one.digits < stop && is_digit(text[at + one.digits])) ++one.digits;
        one.after = detail::trim(text.substr(stop));
        found.push_back(one);
        at = stop;
    }
    return found;
}

bool is_word_end(std::string_view rest) {
    return rest.empty() || !is_letter(rest.front());
}

bool has_unit(const Found& number) {
    if (number.after.starts_with("KELVIN")) return true;
    return number.after.starts_with('K') && is_word_end(number.after.substr(1));
}

// "830", "HF 58W/840": three digits on their own that lamp makers have as a code.
bool is_code(const Found& number) {
    const int value = static_cast<int>(number.value);
    return number.digits == 3 && number.value == value && value >= 618 && value <= 999 && value % 100 >= 18 &&
           value % 100 <= 80 && !is_letter(number.before) && number.before != '.' && number.before != ',' &&
           (number.after.empty() || !(is_letter(number.after.front()) || is_digit(number.after.front())));
}

// is_lamp: the text is a lamp's name, which has other numbers too; there the unit must stand behind a temperature.
void read_temperature(std::string_view text, bool is_lamp, LampColour& colour) {
    std::vector<double> kelvins;
    for (const Found& number : numbers_in(text)) {
        const bool fits = number.value >= kLeast_k && number.value <= kMost_k && !is_letter(number.before);
        if (fits && (has_unit(number) || !is_lamp) && std::ranges::find(kelvins, number.value) == kelvins.end())
            kelvins.push_back(number.value);
    }
    if (kelvins.size() == 1) colour.cct_k = kelvins.front();
    if (!kelvins.empty()) return;
    for (const Found& number : numbers_in(text)) {
        if (!is_code(number) || (is_lamp && number.before != '/')) continue;
        const int code = static_cast<int>(number.value);
        colour.cct_k = 100.0 * (code % 100);
        if (!colour.cri) {
            colour.cri = 10.0 * (code / 100);
            colour.cri_is_least = true;
        }
        return;
    }
}

void set_index(const Found& number, std::string_view text, LampColour& colour) {
    if (!(number.value > 0.0) || number.value > 100.0 || colour.cri) return;
    const std::string_view before = detail::trim(text.substr(0, number.begin));
    const bool range =
        number.after.starts_with('-') || number.after.starts_with('+') || number.after.starts_with("\xe2\x80\x93");
    colour.cri = number.value;
    colour.cri_is_least = range || before.ends_with('>') || before.ends_with("\xe2\x89\xa5") || before.ends_with(">=");
}

void read_rendering(std::string_view text, LampColour& colour) {
    struct Group {
        std::string_view name;
        double least;
    };
    constexpr Group kGroups[] = {{"1A", 90}, {"1B", 80}, {"2A", 70}, {"2B", 60}, {"3", 40}, {"4", 20}};
    const std::string_view trimmed = detail::trim(text);
    for (const auto& [name, least] : kGroups) {
        const std::string_view rest = trimmed.substr(std::min(name.size(), trimmed.size()));
        if (!trimmed.starts_with(name) || (!rest.empty() && (is_digit(rest.front()) || is_letter(rest.front()) ||
                                                             rest.front() == '.' || rest.front() == ',')))
            continue;
        colour.cri = least;
        colour.cri_is_least = true;
        return;
    }
    for (const Found& number : numbers_in(text)) {
        if (number.digits <= 3 && number.value >= 10.0) set_index(number, text, colour);
    }
}

// "LED 2700K CRI90", "Ra > 80" within a lamp's name.
void read_named_index(std::string_view text, LampColour& colour) {
    for (const Found& number : numbers_in(text)) {
        std::string_view before = text.substr(0, number.begin);
        const std::size_t end = before.find_last_not_of(" >=:\xe2\x89\xa5");
        before = end == std::string_view::npos ? std::string_view() : before.substr(0, end + 1);
        const bool behind = before.ends_with("CRI") || before.ends_with("RA");
        const bool ahead = number.after.starts_with("CRI") && is_word_end(number.after.substr(3));
        if ((behind || ahead) && number.value >= 10.0) set_index(number, text, colour);
    }
}

}  // namespace

LampColour lamp_colour(const Photometry& photometry) {
    LampColour colour;
    const auto each = [&](auto keys, auto read) {
        for (const std::string_view key : keys)
            for (const auto& [name, value] : photometry.provenance.keywords)
                if (detail::to_upper(name) == key)
                    read(detail::to_upper(std::string_view(value).substr(0, kMostText_bytes)));
    };
    each(std::array{"_CRI", "CRI", "_SEARCH_CRI", "_COLORRENDERING", "_RA"}, [&](const std::string& text) {
        if (!colour.cri) read_rendering(text, colour);
    });
    each(std::array{"_COLORTEMP", "COLORTEMP", "_CCT", "CCT", "_SEARCH_COLORTEMP", "_COLORTEMPERATURE"},
         [&](const std::string& text) {
             if (!colour.cct_k) read_temperature(text, false, colour);
         });
    each(std::array{"LAMP", "LAMPCAT"}, [&](const std::string& text) {
        if (!colour.cri) read_named_index(text, colour);
        if (!colour.cct_k) read_temperature(text, true, colour);
    });
    return colour;
}

}  // namespace gonio::ies
