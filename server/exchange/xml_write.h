// Writing XML. Only for .cpp files, because it brings pugixml.
#pragma once

#include <charconv>
#include <cmath>
#include <initializer_list>
#include <pugixml.hpp>
#include <sstream>
#include <string>
#include <utility>

namespace gonio::exchange {

// Result: the shortest decimals that read back as the same number, without an exponent, which GDTF allows in no matrix
// and in no DMX value; "0" of -0.
inline std::string number_text(double value) {
    char text[400];  // of the least double 343
    return {text, std::to_chars(text, text + sizeof text, value + 0.0, std::chars_format::fixed).ptr};
}
// The same of a matrix's entry, a ratio, m or mm: what is only rounding of 0 is 0.
inline std::string entry_text(double value) {
    return number_text(std::abs(value) < 1e-12 ? 0.0 : value);
}

using Attributes = std::initializer_list<std::pair<const char*, std::string>>;
inline pugi::xml_node add_node(pugi::xml_node parent, const char* name, Attributes attributes = {}) {
    pugi::xml_node node = parent.append_child(name);
    for (const auto& [attribute, value] : attributes) node.append_attribute(attribute).set_value(value.c_str());
    return node;
}
inline pugi::xml_node add_text(pugi::xml_node parent, const char* name, const std::string& text) {
    pugi::xml_node node = parent.append_child(name);
    node.text().set(text.c_str());
    return node;
}
// Result: the document in UTF-8.
inline std::string text_of(const pugi::xml_document& document) {
    std::ostringstream text;
    document.save(text, "  ", pugi::format_default, pugi::encoding_utf8);
    return text.str();
}

}  // namespace gonio::exchange
