// What GET /v1/blobs/SHA256 serves: the files of the scene at hand and the profiles in it, for servers that follow this
// one. Nothing else can be had by it.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>

namespace gonio {

struct Blob {
    std::shared_ptr<const std::string> content;  // null: it is in the file
    std::string file;
    std::uint64_t bytes = 0;
};
using Blobs = std::map<std::string, Blob, std::less<>>;  // by SHA-256, hexadecimal

}  // namespace gonio
