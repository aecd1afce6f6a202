#pragma once

#include <charconv>
#include <string>

namespace gonio {

// Result: the shortest text that reads back as the same number, whatever the locale.
inline std::string number_text(double value) {
    char text[40];
    return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

}  // namespace gonio
