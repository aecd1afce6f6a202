// SHA-256 (FIPS 180-4) of what a sequence depends on and of what it wrote.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "server/scene/scene.h"

namespace gonio::sequence {

// Result: 64 hexadecimal digits.
std::string sha256(std::string_view bytes);

// Result: of a file's bytes, and how many there are; an empty text where it cannot be read. It takes as long as the
// disk.
struct FileDigest {
    std::string sha256;
    std::size_t bytes = 0;
};
FileDigest sha256_of_file(const std::string& path);

// Result: of a scene's geometry, materials, images and lights, wherever its file is.
std::string sha256_of_asset(const SceneAsset& asset);

}  // namespace gonio::sequence
