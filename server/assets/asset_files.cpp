#include <set>

#include "server/assets/assets.h"
#include "server/base/sha256.h"

namespace gonio {

std::shared_ptr<const AssetFiles> hashed_files(const std::filesystem::path& folder,
                                               const std::vector<std::filesystem::path>& files) {
    auto result = std::make_shared<AssetFiles>();
    result->folder = folder.string();
    std::set<std::string> seen;
    for (const std::filesystem::path& file : files) {
        std::string path = file.generic_string();
        if (!seen.insert(path).second) continue;
        const FileDigest digest = sha256_of_file((folder / file).string());
        if (digest.sha256.empty() || seen.size() > kMostAssetFiles) return nullptr;
        result->files.push_back({std::move(path), digest.sha256, digest.bytes});
    }
    return result;
}

}  // namespace gonio
