// Bounded reading of XML. Only for .cpp files, because it brings pugixml. Entities of a document's own DOCTYPE are not
// expanded, and nothing outside the text is opened.
#pragma once

#include <optional>
#include <pugixml.hpp>
#include <string>
#include <string_view>

#include "ies/core/result.h"

namespace gonio::exchange {

inline constexpr std::size_t kMaxXmlBytes = std::size_t{64} << 20;
inline constexpr std::size_t kMaxXmlMarks = 4'000'000;  // of '<' and '=': some 56 bytes of memory each

// text: of a whole document. code: of refusals. Result: true, and the document holds it. Errors: `code` with the byte
// as place, "too_large".
Result<bool> read_xml(std::string_view text, const char* code, pugi::xml_document& document);

// Result: the number that the whole text is, blanks on both sides left out; nothing where it is anything else ("2,5",
// "0x10", "1 m"), or where it is not finite. Whatever the locale, the decimal point is a point.
std::optional<double> number_of(std::string_view text);
std::optional<long long> whole_number_of(std::string_view text);
// Result: the attribute's number, or nothing where it has none or is missing.
std::optional<double> number_of(const pugi::xml_node& node, const char* attribute);

// Result: without blanks, tabs and line ends on both sides.
std::string_view trimmed(std::string_view text);
std::string_view attribute_of(const pugi::xml_node& node, const char* attribute);
// Result: what a note names of a value that is none, of an attribute or element: "Lens LuminousFlux=10000,75".
std::string written(std::string_view name, const char* place, std::string_view value);

// Result: the text of a child, trimmed; empty where it is missing.
std::string_view child_text(const pugi::xml_node& node, const char* child);

}  // namespace gonio::exchange
