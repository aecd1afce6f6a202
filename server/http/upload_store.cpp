#include "server/http/upload_store.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <thread>

#include "protocol/schema/upload_name.h"
#include "protocol/text/shortened_text.h"
#include "server/base/own_folder.h"

namespace gonio {
namespace {

namespace fs = std::filesystem;

Error unwritable(const std::string& place, int number) {
    const bool full = number == ENOSPC || number == EDQUOT;
    return {full ? "full" : "file_unwritable", place, "",
            std::string("The upload cannot be written: ") + std::strerror(number) + "."};
}

}  // namespace

Result<std::unique_ptr<UploadStore>> UploadStore::open(const std::string& folder, const HttpLimits& limits) {
    std::string path = folder;
    std::error_code failed;
    if (folder.empty()) {
        const char* runtime = std::getenv("XDG_RUNTIME_DIR");
        const bool usable = runtime != nullptr && *runtime == '/' && access(runtime, W_OK) == 0;
        const fs::path parent = usable ? fs::path(runtime) : fs::temp_directory_path(failed);
        if (failed) return unwritable(parent.string(), failed.value());
        auto own = make_own_folder(parent.string(), ".goniod-uploads");
        if (!own) return own.error();
        return std::unique_ptr<UploadStore>(new UploadStore(std::move(own->path), true, std::move(own->held), limits));
    }
    fs::create_directories(folder, failed);
    if (failed) return unwritable(folder, failed.value());
    path = fs::canonical(folder, failed).string();
    Descriptor fd(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (!fd) return unwritable(path, errno);
    // Until the descriptor is closed, also by a kill. Where the disk knows no locks the folder is nobody's for sure.
    const bool held = ::flock(fd.fd(), LOCK_EX | LOCK_NB) == 0;
    if (!held && errno == EWOULDBLOCK)
        return Error{"busy", path, "", "Another server uses this folder for uploads; each needs one of its own."};
    std::unique_ptr<UploadStore> store(new UploadStore(path, false, std::move(fd), limits));
    store->count(held);
    return store;
}

UploadStore::UploadStore(std::string folder, bool own, Descriptor fd, const HttpLimits& limits)
    : folder_(std::move(folder)), own_(own), fd_(std::move(fd)), limits_(limits) {}

UploadStore::~UploadStore() {
    discard(std::chrono::milliseconds(0));
}

bool UploadStore::discard(std::chrono::milliseconds time) const {
    if (!own_) return true;
    const auto end = std::chrono::steady_clock::now() + time;
    for (;;) {
        // A file that appears behind the one that removes keeps the folder: once more then.
        std::error_code failed, gone;
        fs::remove_all(folder_, failed);
        if (!fs::exists(folder_, gone) && !gone) return true;
        if (std::chrono::steady_clock::now() >= end) return false;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
}

// What an earlier run left unfinished is removed, where nobody else can be at it.
void UploadStore::count(bool held) {
    std::error_code ignored;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_, ignored)) {
        const std::string name = entry.path().filename().string();
        if (name.starts_with(".part-")) {
            if (held) fs::remove_all(entry.path(), ignored);  // a file, or the folder of a scene that was in use
        } else if (entry.is_regular_file(ignored)) {
            ++files_;
            bytes_ += entry.file_size(ignored);
        }
    }
}

std::optional<std::uint64_t> UploadStore::size_of(const std::string& name) const {
    struct stat status {};
    if (fstatat(fd_.fd(), name.c_str(), &status, AT_SYMLINK_NOFOLLOW) != 0) return std::nullopt;
    return static_cast<std::uint64_t>(status.st_size);
}

Result<UploadPart> UploadStore::begin(const std::string& name, std::uint64_t declared_bytes) {
    if (!is_upload_name(name))
        return Error{"invalid_argument", "name", shortened_text(name, kMaxUploadName), std::string(kUploadNameRule)};
    if (declared_bytes > limits_.upload_bytes)
        return Error{"too_large", name, std::to_string(declared_bytes) + " bytes",
                     "An upload has at most " + std::to_string(limits_.upload_bytes) + " bytes."};
    if (bytes_ + declared_bytes > limits_.upload_total_bytes || (!size_of(name) && files_ >= limits_.upload_files))
        return Error{"full", name, std::to_string(bytes_) + " bytes in " + std::to_string(files_) + " files",
                     "There is no room for more uploads; DELETE one."};
    UploadPart part;
    part.name = name;
    part.temporary_name = ".part-" + std::to_string(getpid()) + "-" + std::to_string(++next_part_);
    part.fd = openat(fd_.fd(), part.temporary_name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600);
    if (part.fd < 0) return unwritable(name, errno);
    return part;
}

Result<bool> UploadStore::write(UploadPart& part, std::span<const char> bytes) {
    if (part.bytes + bytes.size() > limits_.upload_bytes)
        return Error{"too_large", part.name, std::to_string(part.bytes + bytes.size()) + " bytes",
                     "An upload has at most " + std::to_string(limits_.upload_bytes) + " bytes."};
    if (bytes_ + bytes.size() > limits_.upload_total_bytes)
        return Error{"full", part.name, std::to_string(bytes_) + " bytes",
                     "There is no room for more uploads; DELETE one."};
    for (std::size_t done = 0; done < bytes.size();) {
        const ssize_t n = ::write(part.fd, bytes.data() + done, bytes.size() - done);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return unwritable(part.name, n == 0 ? ENOSPC : errno);
        done += static_cast<std::size_t>(n);
        part.bytes += static_cast<std::uint64_t>(n);
        bytes_ += static_cast<std::uint64_t>(n);
    }
    return true;
}

Result<bool> UploadStore::finish(UploadPart& part) {
    const bool written = ::close(std::exchange(part.fd, -1)) == 0;
    const int close_error = errno;
    const std::optional<std::uint64_t> replaced = size_of(part.name);
    if (!replaced && files_ >= limits_.upload_files) {  // others were finished since it began
        abandon(part);
        return Error{"full", part.name, std::to_string(files_) + " files",
                     "There is no room for more uploads; DELETE one."};
    }
    if (!written || renameat(fd_.fd(), part.temporary_name.c_str(), fd_.fd(), part.name.c_str()) != 0) {
        const int number = written ? errno : close_error;
        abandon(part);
        return unwritable(part.name, number);
    }
    bytes_ -= std::min(bytes_, replaced.value_or(0));
    if (!replaced) ++files_;
    part.temporary_name.clear();
    return replaced.has_value();
}

void UploadStore::abandon(UploadPart& part) {
    if (part.fd >= 0) ::close(std::exchange(part.fd, -1));
    if (part.temporary_name.empty()) return;
    unlinkat(fd_.fd(), part.temporary_name.c_str(), 0);
    part.temporary_name.clear();
    bytes_ -= std::min(bytes_, part.bytes);
}

bool UploadStore::remove(const std::string& name) {
    if (!is_upload_name(name)) return false;
    const std::optional<std::uint64_t> removed = size_of(name);
    if (!removed || unlinkat(fd_.fd(), name.c_str(), 0) != 0) return false;
    bytes_ -= std::min(bytes_, *removed);
    if (files_ > 0) --files_;
    return true;
}

}  // namespace gonio
