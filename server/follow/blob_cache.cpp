#include "server/follow/blob_cache.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "server/base/bounded_file.h"
#include "server/base/descriptor.h"
#include "server/base/sha256.h"

namespace gonio {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPart = ".part";
constexpr const char* kScene = "scene-";

Error unwritable(const std::string& path, const std::string& why) {
    return {"file_unwritable", "follow", path, "The file cannot be written: " + why + "."};
}

// Whether a folder of this name is one that folder_of() made. The folder may hold what is somebody else's.
bool is_scene_folder(const fs::directory_entry& entry) {
    const std::string name = entry.path().filename().string();
    std::error_code failed;
    return name.starts_with(kScene) && is_sha256(name.substr(std::strlen(kScene))) &&
           entry.symlink_status(failed).type() == fs::file_type::directory;
}

bool write_all(int fd, std::string_view bytes) {
    while (!bytes.empty()) {
        const ssize_t done = ::write(fd, bytes.data(), bytes.size());
        if (done < 0 && errno == EINTR) continue;
        if (done <= 0) return false;
        bytes.remove_prefix(static_cast<std::size_t>(done));
    }
    return true;
}

}  // namespace

BlobCache::BlobCache(std::string folder, std::uint64_t file_bytes, std::uint64_t all_bytes, Fetch fetch)
    : folder_(std::move(folder)), file_bytes_(file_bytes), all_bytes_(all_bytes), fetch_(std::move(fetch)) {}

Result<bool> BlobCache::fetch(const std::string& sha256, const std::string& path) {
    const std::string part = folder_ + "/" + kPart;
    Descriptor file(::open(part.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0600));
    if (!file) return unwritable(part, std::strerror(errno));
    Sha256 digest;
    int fault = 0;
    const auto fetched = fetch_(sha256, file_bytes_, [&](std::string_view bytes) {
        digest.add(bytes.data(), bytes.size());
        if (!write_all(file.fd(), bytes)) fault = errno == 0 ? ENOSPC : errno;
        return fault == 0;
    });
    Result<bool> result = true;
    if (fault != 0)
        result = unwritable(part, std::strerror(fault));
    else if (!fetched)
        result = fetched.error();
    else if (const std::string came = digest.text(); came != sha256)
        result = Error{"bad_hash", "follow", came, "what came for " + sha256 + " has another hash"};
    else if (::fsync(file.fd()) != 0 || ::rename(part.c_str(), path.c_str()) != 0)
        result = unwritable(path, std::strerror(errno));
    if (!result) ::unlink(part.c_str());
    return result;
}

Result<std::string> BlobCache::file(const std::string& sha256) {
    std::string path = folder_ + "/" + sha256;
    if (sha256_of_file(path).sha256 == sha256) {
        ::utimensat(AT_FDCWD, path.c_str(), nullptr, AT_SYMLINK_NOFOLLOW);  // it is used now
        return path;
    }
    if (const auto fetched = fetch(sha256, path); !fetched) return fetched.error();
    make_room(sha256);
    return path;
}

void BlobCache::make_room(const std::string& kept) const {
    struct Row {
        fs::file_time_type used;
        std::uint64_t bytes;
        fs::path path;
    };
    std::vector<Row> rows;
    std::uint64_t bytes = 0;
    std::error_code failed;
    for (const auto& entry : fs::directory_iterator(folder_, failed)) {
        if (!is_sha256(entry.path().filename().string()) || !entry.is_regular_file(failed)) continue;
        rows.push_back({entry.last_write_time(failed), entry.file_size(failed), entry.path()});
        bytes += rows.back().bytes;
    }
    std::ranges::sort(rows, {}, &Row::used);
    for (const Row& row : rows) {
        if (bytes <= all_bytes_) return;
        if (row.path.filename() == kept) continue;
        fs::remove(row.path, failed);
        bytes -= row.bytes;
    }
}

Result<std::string> BlobCache::content(const std::string& sha256, std::uint64_t most_bytes) {
    const auto path = file(sha256);
    if (!path) return path.error();
    auto text = read_bounded_file(*path, most_bytes);
    if (!text) return text.error();
    if (text->size() > most_bytes)
        return Error{"too_large", "follow", sha256, "it has more than " + std::to_string(most_bytes) + " bytes"};
    if (gonio::sha256(*text) != sha256)
        return Error{"bad_hash", "follow", sha256, "the folder does not keep what is written there"};
    return text;
}

Result<std::string> BlobCache::folder_of(const std::vector<AssetFile>& files) {
    std::string all;
    std::uint64_t bytes = 0;
    for (const AssetFile& file : files) {
        all += file.path + '\0' + file.sha256 + '\n';
        if (file.bytes > file_bytes_)
            return Error{"too_large", "follow", file.path,
                         "it has " + std::to_string(file.bytes) + " bytes, more than --max-upload-mib"};
        bytes += file.bytes;
    }
    if (bytes > all_bytes_)
        return Error{"too_large", "follow", std::to_string(bytes) + " bytes",
                     "the scene's files have more than --max-uploads-mib"};
    std::error_code failed;
    for (const auto& entry : fs::directory_iterator(folder_, failed))
        if (is_scene_folder(entry)) fs::remove_all(entry.path(), failed);
    const fs::path folder = fs::path(folder_) / (kScene + sha256(all));
    for (const AssetFile& one : files) {
        const auto path = file(one.sha256);
        if (!path) return path.error();
        const fs::path at = folder / one.path;
        fs::create_directories(at.parent_path(), failed);
        if (::link(path->c_str(), at.c_str()) != 0) return unwritable(at.string(), std::strerror(errno));
    }
    return folder.string();
}

}  // namespace gonio
