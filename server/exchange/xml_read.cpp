#include "server/exchange/xml_read.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "ies/core/text.h"

namespace gonio::exchange {
namespace {

template <typename T>
std::optional<T> whole_text(std::string_view text) {
    text = trimmed(text);
    if (text.starts_with('+')) {
        text.remove_prefix(1);
        if (text.starts_with('-')) return std::nullopt;
    }
    T value{};
    const char* const end = text.data() + text.size();
    const auto parsed = std::from_chars(text.data(), end, value);
    if (parsed.ec != std::errc() || parsed.ptr != end) return std::nullopt;
    return value;
}

}  // namespace

Result<bool> read_xml(std::string_view text, const char* code, pugi::xml_document& document) {
    if (text.size() > kMaxXmlBytes)
        return Error{"too_large", "", std::to_string(text.size()) + " bytes",
                     "an XML document has at most " + std::to_string(kMaxXmlBytes >> 20) + " MiB"};
    const auto marks = std::count_if(text.begin(), text.end(), [](char c) { return c == '<' || c == '='; });
    if (static_cast<std::size_t>(marks) > kMaxXmlMarks)
        return Error{"too_large", "", std::to_string(marks) + " marks",
                     "an XML document has at most " + std::to_string(kMaxXmlMarks) + " of < and ="};
    const auto parsed = document.load_buffer(text.data(), text.size());
    if (!parsed)
        return Error{code, "byte " + std::to_string(parsed.offset), "",
                     std::string("not XML: ") + parsed.description()};
    return true;
}

std::string_view trimmed(std::string_view text) {
    constexpr std::string_view kBlanks = " \t\r\n";
    const std::size_t first = text.find_first_not_of(kBlanks);
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

std::string written(std::string_view name, const char* place, std::string_view value) {
    return std::string(name) + " " + place + "=" + shown_text(trimmed(value));
}

std::optional<double> number_of(std::string_view text) {
    const auto value = whole_text<double>(text);
    return value && std::isfinite(*value) ? value : std::nullopt;
}

std::optional<long long> whole_number_of(std::string_view text) {
    return whole_text<long long>(text);
}

std::optional<double> number_of(const pugi::xml_node& node, const char* attribute) {
    return number_of(attribute_of(node, attribute));
}

std::string_view attribute_of(const pugi::xml_node& node, const char* attribute) {
    return node.attribute(attribute).value();
}

std::string_view child_text(const pugi::xml_node& node, const char* child) {
    return trimmed(node.child(child).text().get());
}

}  // namespace gonio::exchange
