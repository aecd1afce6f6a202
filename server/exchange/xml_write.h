// Writing XML. Only for .cpp files, because it brings pugixml.
#pragma once

#include <initializer_list>
#include <pugixml.hpp>
#include <sstream>
#include <string>
#include <utility>

#include "ies/core/number_text.h"

namespace gonio::exchange {

// Result: as gonio::number_text, but "0" of -0.
inline std::string number_text(double value) {
    return gonio::number_text(value + 0.0);
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
