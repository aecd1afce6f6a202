// The files that a scene was read from, by their content: whoever has the same files has the same scene.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace gonio {

struct AssetFile {
    std::string path;    // from the folder, with '/'
    std::string sha256;  // of its content, hexadecimal
    std::uint64_t bytes = 0;
};

struct AssetFiles {
    std::string folder;            // on this machine
    std::vector<AssetFile> files;  // the scene's own first, then those that it names, each once
};

}  // namespace gonio
