#include "server/base/atomic_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <system_error>
#include <tuple>

namespace gonio {
namespace {

// Result: 0, or why not everything is on the disk.
int write_whole(int fd, std::string_view bytes) {
    while (!bytes.empty()) {
        const ssize_t written = ::write(fd, bytes.data(), bytes.size());
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) return errno;
        bytes.remove_prefix(static_cast<std::size_t>(written));
    }
    return ::fsync(fd) == 0 ? 0 : errno;
}

constexpr int kMostAside = 99;
constexpr int kMostLinks = 40;  // as the kernel follows

std::string aside_name(const std::string& path, const std::string& ending, int number) {
    return path + ending + (number > 1 ? "-" + std::to_string(number) : "");
}

}  // namespace

Error unwritable(const std::string& path, int reason) {
    return {"file_unwritable", "", path, std::generic_category().message(reason)};
}

void sync_folder_of(const std::string& path) {
    const std::string folder = std::filesystem::path(path).parent_path().string();
    const Descriptor opened(::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (opened) ::fsync(opened.fd());
}

Result<bool> write_file_atomically(const std::string& path, std::string_view bytes) {
    return write_file_by_way_of(path + ".part", path, bytes);
}

Result<bool> write_file_by_way_of(const std::string& part, const std::string& path, std::string_view bytes) {
    struct stat before {};
    const bool replaces = ::stat(path.c_str(), &before) == 0;
    ::unlink(part.c_str());  // of a writer that was killed
    const int fd = ::open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, replaces ? 0600 : 0644);
    if (fd < 0) return unwritable(path, errno);
    if (replaces) std::ignore = ::fchmod(fd, before.st_mode & 0777);  // not every file system has permissions
    int reason = write_whole(fd, bytes);
    if (::close(fd) != 0 && reason == 0) reason = errno;
    if (reason == 0 && std::rename(part.c_str(), path.c_str()) != 0) reason = errno;
    if (reason != 0) {
        ::unlink(part.c_str());
        return unwritable(path, reason);
    }
    sync_folder_of(path);
    return true;
}

std::string behind_links(std::string path) {
    namespace fs = std::filesystem;
    std::error_code failed;
    for (int i = 0; i < kMostLinks && fs::is_symlink(path, failed); ++i) {
        const fs::path target = fs::read_symlink(path, failed);
        if (failed) break;
        path = (fs::path(path).parent_path() / target).string();
    }
    return path;
}

Result<FileLock> FileLock::take(const std::string& path) {
    struct stat status {};
    if (::stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode)) return FileLock({}, 0);
    // Readable for all: another user's server must be able to ask for it.
    Descriptor file(::open((path + ".lock").c_str(), O_RDONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0644));
    if (!file) return FileLock({}, errno);
    if (::flock(file.fd(), LOCK_EX | LOCK_NB) == 0) return FileLock(std::move(file), 0);
    if (errno == EWOULDBLOCK)
        return Error{"busy", path, "", "Another server keeps its show in this file; each needs one of its own."};
    return FileLock({}, errno);
}

std::string FileLock::why_not() const {
    return reason_ == 0 ? "" : std::generic_category().message(reason_);
}

Result<std::string> set_file_aside(const std::string& path, const std::string& ending) {
    int i = 1;
    while (i < kMostAside && ::access(aside_name(path, ending, i).c_str(), F_OK) == 0) ++i;
    const std::string name = aside_name(path, ending, i);
    if (std::rename(path.c_str(), name.c_str()) != 0) return unwritable(path, errno);
    return name;
}

Result<std::string> keep_file_aside(const std::string& path, const std::string& ending) {
    for (int i = 1; i <= kMostAside; ++i) {
        const std::string name = aside_name(path, ending, i);
        if (::link(path.c_str(), name.c_str()) == 0) {
            sync_folder_of(path);
            return name;
        }
        if (errno != EEXIST) break;
        std::error_code failed;
        if (std::filesystem::equivalent(path, name, failed)) return name;
    }
    return set_file_aside(path, ending);
}

}  // namespace gonio
