// XML from outside, by pugixml, within limits. Internal to ies/.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>

#include "ies/core/result.h"

namespace pugi {
class xml_document;
class xml_node;
}  // namespace pugi

namespace gonio::ies::detail {

// What a document may have, counted in its bytes before memory is taken: at most some 400 MiB for both.
inline constexpr std::size_t kMaxXmlTags = 2u << 20;        // of '<': "too_many_elements"
inline constexpr std::size_t kMaxXmlAttributes = 4u << 20;  // of '=': likewise

// Result: whether the bytes begin as XML does.
bool looks_like_xml(std::string_view bytes);

// Result: the document as UTF-8 without byte order mark, from UTF-8, UTF-16 with a mark, or an 8-bit page.
std::string xml_as_utf8(std::string_view bytes);

// Parses text, which xml_as_utf8 gave; places in the document are places in it. Entities other than XML's own five are
// left as they stand, and a document type is refused: nothing expands. Errors: empty_file, too_many_elements,
// xml_doctype, bad_xml.
std::optional<Error> parse_xml(std::string_view text, pugi::xml_document& document);

// Result: where the element stands in its text.
std::size_t offset_of(const pugi::xml_node& element);

// Result: the element's own text, without blanks at its ends.
std::string_view text_of(const pugi::xml_node& element);

// Result: whether the element's text is true, as xs:boolean has it.
bool is_true(const pugi::xml_node& element);

// Result: the first of these children that is there, an empty node where none is.
pugi::xml_node child_of(const pugi::xml_node& element, std::initializer_list<const char*> names);

// Reads a number that stands alone, as an element's text or an attribute's value. what: its name, for the error.
// Errors: not_a_number, not_finite, at the element.
std::optional<Error> read_number(std::string_view text, const pugi::xml_node& element, std::string_view number,
                                 std::string_view what, double& value);

// The same of the first of these children that is there; value stays where none is.
std::optional<Error> optional_number(std::string_view text, const pugi::xml_node& element,
                                     std::initializer_list<const char*> names, double& value);

}  // namespace gonio::ies::detail
