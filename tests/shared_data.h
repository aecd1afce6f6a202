// The samples that tests read where they are there: public photometry, formats, scenes, models and cases.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <optional>

namespace gonio::test {

// Result: the path of a file or folder of them, such as "cases/29-grid-in-furniture/room.gltf". They lie in `data`
// below GONIO_SHARED, or below the folder `shared` beside the source tree. Empty where the path does not exist.
inline std::optional<std::filesystem::path> shared_data(const std::filesystem::path& below) {
    const char* const set = std::getenv("GONIO_SHARED");
    const std::filesystem::path root =
        set != nullptr ? std::filesystem::path(set) : std::filesystem::path(GONIO_SOURCE_DIR) / ".." / "shared";
    std::filesystem::path path = root / "data" / below;
    if (!std::filesystem::exists(path)) return std::nullopt;
    return path;
}

}  // namespace gonio::test
