#include "protocol/text/toml_read.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>

#include "protocol/text/text_bytes.h"

namespace gonio::toml_read {
namespace {

struct Refused {
    Error error;
};

std::string place_of(const toml::source_position& at) {
    return "line " + std::to_string(at.line) + " column " + std::to_string(at.column);
}

// toml++ walks keys and values as deep as they nest, on the stack: deeper files are refused before it sees them.
// The project's own files nest three deep.
class Depth {
public:
    // c: a character outside strings and comments. Result: whether it may follow.
    bool take(char c) {
        if (c == '.') return ++dots_ <= kMostDots;
        if (c == '[' || c == '{') return dots_ = 0, ++open_ <= kMostOpen;
        if ((c == ']' || c == '}') && open_ > 0) --open_;
        if (c == '\n' || c == ',' || c == '=') dots_ = 0;
        return true;
    }

private:
    static constexpr int kMostDots = 8, kMostOpen = 8;
    int dots_ = 0;  // of the key, or number, that we are in
    int open_ = 0;  // brackets and braces
};

// Result: the same TOML in ASCII: characters of double-quoted strings and comments become \UXXXXXXXX, others and
// control characters are refused. toml++ 3.3 runs into undefined behaviour on some of them where they do not belong.
Result<std::string> ascii_toml(const Text& given) {
    const std::string_view text = given.text;
    std::string ascii;
    toml::source_position place{1, 1};
    const auto refused = [&](std::string value, std::string message) {
        return Error{given.code, place_of(place), std::move(value), std::move(message)};
    };
    std::string_view until;  // what ends the string or comment that we are in; empty: in none
    Depth depth;
    for (std::size_t at = 0; at < text.size();) {
        const char c = text[at];
        const auto byte = static_cast<unsigned char>(c);
        const bool space = c == '\t' || c == '\n' || c == '\r';
        std::size_t step = unseen_length(text, at) > 0 && !space ? 0 : utf8_length(text, at);
        if (step > 1 && (until.empty() || until.front() == '\'')) step = 0;
        if (step == 0)
            return refused(
                std::to_string(byte),
                std::string(given.what) +
                    " is ASCII without control characters, but for UTF-8 in double-quoted strings and comments");
        if (step > 1) {
            std::uint32_t code = byte & (0x7Fu >> step);
            for (std::size_t i = 1; i < step; ++i) code = code << 6 | (text[at + i] & 0x3Fu);
            char escape[16];
            std::snprintf(escape, sizeof escape, "\\U%08X", static_cast<unsigned>(code));
            ascii += escape;
        } else {
            if (c == '\n') depth.take(c);  // also at the end of a comment
            if (until.empty()) {
                if (!depth.take(c))
                    return refused(std::string(1, c),
                                   "keys and values of " + std::string(given.what) + " do not nest so deeply");
                if (c == '#') until = "\n";
                if (c == '"' || c == '\'') {
                    const std::string_view three = c == '"' ? "\"\"\"" : "\'\'\'";
                    until = text.substr(at).starts_with(three) ? three : three.substr(0, 1);
                    step = until.size();
                }
            } else if (until.front() == '"' && c == '\\' && at + 1 < text.size() &&
                       (text[at + 1] == '"' || text[at + 1] == '\\')) {
                step = 2;
            } else if (text.substr(at).starts_with(until) || (c == '\n' && until.size() == 1)) {
                step = c == '\n' ? 1 : until.size();
                until = {};
            }
            ascii += text.substr(at, step);
        }
        place.column = c == '\n' ? 1 : place.column + static_cast<toml::source_index>(step);
        place.line += c == '\n' ? 1 : 0;
        at += step;
    }
    return ascii;
}

// Result: the same place in the text as it was given: what is one character there is ten in ASCII.
std::string in_given(std::string_view text, const std::string& place) {
    unsigned line = 0, column = 0;
    if (std::sscanf(place.c_str(), "line %u column %u", &line, &column) != 2) return place;
    std::size_t start = 0;
    for (unsigned i = 1; i < line && start < text.size(); ++i) {
        const std::size_t end = text.find('\n', start);
        start = end == std::string_view::npos ? text.size() : end + 1;
    }
    std::size_t at = start;
    for (unsigned seen = 1; seen < column && at < text.size() && text[at] != '\n';) {
        const std::size_t step = std::max<std::size_t>(utf8_length(text, at), 1);
        seen += step > 1 ? 10 : 1;
        at += step;
    }
    return "line " + std::to_string(line) + " column " + std::to_string(at - start + 1);
}

}  // namespace

Result<bool> read(const Text& text, const std::function<void(const toml::table&)>& take) {
    if (text.text.size() > text.most_bytes)
        return Error{"too_large", "", std::to_string(text.text.size()) + " bytes",
                     std::string(text.what) + " has at most " + std::to_string(text.most_bytes >> 10) + " KiB"};
    const Result<std::string> ascii = ascii_toml(text);
    if (!ascii) return ascii.error();
    try {
        take(toml::parse(*ascii));
        return true;
    } catch (const toml::parse_error& error) {
        return Error{text.code, in_given(text.text, place_of(error.source().begin)), "",
                     std::string(error.description())};
    } catch (const Refused& refused) {
        Error error = refused.error;
        if (error.code.empty()) error.code = text.code;
        error.where = in_given(text.text, error.where);
        return error;
    } catch (const std::runtime_error& error) {
        return Error{text.code, "", "", error.what()};
    }
}

void refuse(const toml::source_region& at, std::string value, std::string message) {
    throw Refused{{"", place_of(at.begin), std::move(value), std::move(message)}};
}

void refuse(Error error) {
    throw Refused{std::move(error)};
}

void only_keys(const toml::table& table, std::initializer_list<std::string_view> known, std::string_view what) {
    for (const auto& [key, node] : table)
        if (std::find(known.begin(), known.end(), key.str()) == known.end())
            refuse(key.source(), std::string(key.str()), "is no key of " + std::string(what));
}

std::string text_of(const toml::node& node) {
    std::ostringstream text;
    if (const auto* table = node.as_table())
        text << "a table of " << table->size();
    else if (const auto* array = node.as_array())
        text << "an array of " << array->size();
    else
        node.visit([&](const auto& value) {
            if constexpr (toml::is_value<decltype(value)>) text << value;
        });
    return text.str().substr(0, 64);
}

std::uint32_t whole_number(const toml::node& node, std::int64_t low, std::int64_t high, const char* what) {
    const auto value = node.as_integer();
    if (value == nullptr || value->get() < low || value->get() > high)
        refuse(
            node.source(), text_of(node),
            std::string(what) + " must be a whole number from " + std::to_string(low) + " to " + std::to_string(high));
    return static_cast<std::uint32_t>(value->get());
}

double number(const toml::node& node, const char* what) {
    const auto value = node.is_number() ? node.value<double>() : std::nullopt;
    if (!value || !std::isfinite(*value)) refuse(node.source(), text_of(node), std::string(what) + " must be a number");
    return *value;
}

bool yes_or_no(const toml::node& node, const char* what) {
    const auto value = node.as_boolean();
    if (value == nullptr) refuse(node.source(), text_of(node), std::string(what) + " must be true or false");
    return value->get();
}

std::string word(const toml::node& node, const char* what) {
    const auto value = node.as_string();
    if (value == nullptr) refuse(node.source(), text_of(node), std::string(what) + " must be a string");
    return value->get();
}

Range range(const toml::node& node) {
    if (const auto* array = node.as_array(); array != nullptr && array->size() == 2) {
        const auto low = (*array)[0].value<double>(), high = (*array)[1].value<double>();
        if (low && high && std::isfinite(*low) && std::isfinite(*high)) return {*low, *high};
    }
    refuse(node.source(), text_of(node), "a range is two numbers: [low, high]");
}

std::string quoted(const std::string& text) {
    std::string result = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') result += '\\';
        if (static_cast<unsigned char>(c) >= 0x20 && c != 0x7F) {
            result += c;
            continue;
        }
        char escape[8];
        std::snprintf(escape, sizeof escape, "\\u%04X", static_cast<unsigned>(c));
        result += escape;
    }
    return result + "\"";
}

}  // namespace gonio::toml_read
