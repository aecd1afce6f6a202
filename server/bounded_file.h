// Files from outside, read into memory as far as a reader takes them.
#pragma once

#include <cstddef>
#include <fstream>
#include <optional>
#include <string>

namespace gonio {

// Result: the file's first `most_bytes` and one more, by which its reader sees that there is too much; nothing where
// it cannot be read.
inline std::optional<std::string> read_bounded_file(const std::string& path, std::size_t most_bytes) {
    std::ifstream file(path, std::ios::binary);
    std::string text(most_bytes + 1, '\0');
    file.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(file.gcount()));
    if (!file.is_open() || file.bad()) return std::nullopt;
    return text;
}

}  // namespace gonio
