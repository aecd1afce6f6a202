// Files that are known by their content: fetched once, kept in a folder under their SHA-256, also from one run to the
// next where the folder is kept. One thread at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "ies/core/result.h"
#include "server/scene/asset_files.h"

namespace gonio {

class BlobCache {
public:
    using Take = std::function<bool(std::string_view)>;
    // Gives the content of this hash to `take` as it comes, at most so many bytes.
    using Fetch = std::function<Result<bool>(const std::string& sha256, std::uint64_t most_bytes, const Take& take)>;

    // folder: is there. file_bytes: of one file, all_bytes: of those that are kept; those that were not used for the
    // longest time go first.
    BlobCache(std::string folder, std::uint64_t file_bytes, std::uint64_t all_bytes, Fetch fetch);

    // Result: a file with this content, at most until the next call; one that the disk has not kept is fetched again.
    // Errors: of Fetch; "too_large"; "bad_hash" where what came has another; "file_unwritable".
    Result<std::string> file(const std::string& sha256);
    // Result: the content, which is in memory: for small files. Errors likewise.
    Result<std::string> content(const std::string& sha256, std::uint64_t most_bytes);
    // files: of safe paths. Result: a folder in which they lie under their paths; the one of the call before is gone.
    // Errors likewise.
    Result<std::string> folder_of(const std::vector<AssetFile>& files);

private:
    Result<bool> fetch(const std::string& sha256, const std::string& path);
    void make_room(const std::string& kept) const;

    std::string folder_;
    std::uint64_t file_bytes_, all_bytes_;
    Fetch fetch_;
};

}  // namespace gonio
