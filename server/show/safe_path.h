// Paths of files that come from outside.
#pragma once

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <string>

#include "protocol/text/shortened_text.h"

namespace gonio {

inline constexpr std::size_t kMaxSafePath = 1024;  // bytes

// Result: whether it is a relative path of plain names: it cannot leave the folder that it is put under.
inline bool is_safe_path(const std::string& path) {
    if (path.empty() || path.size() > kMaxSafePath || path.find('\\') != path.npos) return false;
    if (shortened_text(path, kMaxSafePath) != path) return false;
    const std::filesystem::path file(path);
    return file.is_relative() && file.lexically_normal().generic_string() == path &&
           std::ranges::none_of(file, [](const auto& name) { return name.empty() || name == "." || name == ".."; });
}

}  // namespace gonio
