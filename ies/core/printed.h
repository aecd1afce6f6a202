// Text by a format of printf.
#pragma once

#include <cstdarg>
#include <cstdio>
#include <string>

namespace gonio {

// Result: as std::printf would print it, at most 1,023 bytes.
__attribute__((format(printf, 1, 2))) inline std::string printed(const char* format, ...) {
    char text[1024];
    va_list arguments;
    va_start(arguments, format);
    std::vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    return text;
}

}  // namespace gonio
