#include "ies/xml_text.h"

#include <algorithm>
#include <pugixml.hpp>

#include "ies/text_encoding.h"
#include "ies/text_scan.h"

namespace gonio::ies::detail {

bool looks_like_xml(std::string_view bytes) {
    const std::string decoded = decode_utf16(bytes.substr(0, 256));
    const std::string_view text = decoded.empty() ? without_mark(bytes.substr(0, 4096)) : std::string_view(decoded);
    const std::string_view begin = trim(text);
    return begin.starts_with("<?xml") || begin.starts_with("<IESTM33") || begin.starts_with("<LuminaireOpticalData") ||
           begin.starts_with("<!DOCTYPE");
}

std::string xml_as_utf8(std::string_view bytes) {
    std::string decoded = decode_utf16(bytes);
    if (!decoded.empty()) return decoded;
    const std::string_view text = without_mark(bytes);
    return to_utf8(text, guess_encoding(text));
}

std::optional<Error> parse_xml(std::string_view text, pugi::xml_document& document) {
    if (trim(text).empty()) return error_at(text, 0, "empty_file", {}, "the file is empty");
    const auto tags = static_cast<std::size_t>(std::ranges::count(text, '<'));
    const auto attributes = static_cast<std::size_t>(std::ranges::count(text, '='));
    if (tags > kMaxXmlTags || attributes > kMaxXmlAttributes) {
        return error_at(text, 0, "too_many_elements", std::to_string(std::max(tags, attributes)),
                        "the document has more than 2097152 tags or 4194304 attributes");
    }
    const pugi::xml_parse_result read =
        document.load_buffer(text.data(), text.size(), pugi::parse_default | pugi::parse_doctype, pugi::encoding_utf8);
    for (const pugi::xml_node& node : document.children()) {
        if (node.type() != pugi::node_doctype) continue;
        return error_at(text, std::min(text.find("<!DOCTYPE"), text.size()), "xml_doctype", {},
                        "a document type is not taken: none of these formats has one");
    }
    if (!read) {
        const auto offset = static_cast<std::size_t>(std::max<std::ptrdiff_t>(read.offset, 0));
        return error_at(text, std::min(offset, text.size()), "bad_xml", {},
                        std::string("this is no well-formed XML: ") + read.description());
    }
    return std::nullopt;
}

std::size_t offset_of(const pugi::xml_node& element) {
    return static_cast<std::size_t>(std::max<std::ptrdiff_t>(element.offset_debug(), 0));
}

std::string_view text_of(const pugi::xml_node& element) {
    return trim(element.child_value());
}

std::optional<Error> read_number(std::string_view text, const pugi::xml_node& element, std::string_view number,
                                 std::string_view what, double& value) {
    NumberStream stream{trim(number)};
    NumberStatus status = stream.next(value);
    double more = 0.0;
    if (status == NumberStatus::ok && stream.next(more) != NumberStatus::end) status = NumberStatus::not_a_number;
    if (status == NumberStatus::ok) return std::nullopt;
    const bool finite = status != NumberStatus::not_finite;
    return error_at(text, offset_of(element), finite ? "not_a_number" : "not_finite", trim(number),
                    "the " + std::string(what) + (finite ? " is not a number" : " is not finite"));
}

std::optional<Error> optional_number(std::string_view text, const pugi::xml_node& element,
                                     std::initializer_list<const char*> names, double& value) {
    const pugi::xml_node found = child_of(element, names);
    if (!found) return std::nullopt;
    return read_number(text, found, text_of(found), *names.begin(), value);
}

bool is_true(const pugi::xml_node& element) {
    const std::string text = to_upper(text_of(element));
    return text == "TRUE" || text == "1";
}

pugi::xml_node child_of(const pugi::xml_node& element, std::initializer_list<const char*> names) {
    for (const char* name : names)
        if (const pugi::xml_node found = element.child(name)) return found;
    return {};
}

}  // namespace gonio::ies::detail
