#include "server/base/own_folder.h"

#include <fcntl.h>
#include <stdlib.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <system_error>

#include "server/base/atomic_file.h"

namespace gonio {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kRandomLetters = 6;  // that mkdtemp(3) puts in
constexpr int kMostTries = 100;            // each is lost only to a process that starts at the same moment

Descriptor opened(const std::string& path) {
    return Descriptor(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
}

// Whether the path still names what was opened.
bool is_there(const std::string& path, const Descriptor& folder) {
    struct stat now {
    }, then{};
    return ::fstat(folder.fd(), &then) == 0 && ::lstat(path.c_str(), &now) == 0 && now.st_ino == then.st_ino &&
           now.st_dev == then.st_dev;
}

// Removes the folder unless a process holds it, or it is another user's. The lock is kept until the folder is gone, so
// that a process that has just made it notices.
void remove_if_left(const std::string& path) {
    const Descriptor folder = opened(path);
    struct stat status {};
    if (!folder || ::fstat(folder.fd(), &status) != 0 || status.st_uid != ::geteuid()) return;
    if (::flock(folder.fd(), LOCK_EX | LOCK_NB) != 0 || !is_there(path, folder)) return;
    std::error_code failed;
    fs::remove_all(path, failed);
}

}  // namespace

Result<OwnFolder> make_own_folder(const std::string& parent, const std::string& prefix) {
    const std::string begin = prefix + "-";
    std::error_code failed;
    for (fs::directory_iterator entry(parent, failed), end; !failed && entry != end; entry.increment(failed)) {
        const std::string name = entry->path().filename().string();
        if (name.starts_with(begin) && name.size() == begin.size() + kRandomLetters) remove_if_left(entry->path());
    }
    int reason = 0;
    std::string path;
    for (int i = 0; i < kMostTries; ++i) {
        path = (fs::path(parent) / (begin + std::string(kRandomLetters, 'X'))).string();
        if (::mkdtemp(path.data()) == nullptr) return unwritable(path, errno);
        Descriptor folder = opened(path);
        if (!folder) {
            reason = errno;
            if (reason == ENOENT) continue;
            break;
        }
        // Another process may take it for one that was left, between its making and its lock.
        const bool locked = ::flock(folder.fd(), LOCK_EX | LOCK_NB) == 0;
        reason = errno;
        if (locked ? is_there(path, folder) : reason != EWOULDBLOCK)
            return OwnFolder{std::move(path), std::move(folder)};
    }
    return unwritable(path, reason);
}

}  // namespace gonio
