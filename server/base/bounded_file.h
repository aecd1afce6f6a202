// Files from outside, read into memory as far as a reader takes them.
#pragma once

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <string>
#include <system_error>

#include "ies/core/result.h"
#include "server/base/descriptor.h"

namespace gonio {

// Result: the file's first `most_bytes` and one more, by which its reader sees that there is too much. Regular files
// only: whoever opens or reads a pipe or a device may wait for ever. Errors: "file_unreadable" with the path as place
// and a message whose subject is the file ("is no regular file"). Any thread; it takes as long as the disk.
inline Result<std::string> read_bounded_file(const std::string& path, std::size_t most_bytes) {
    const auto refused = [&](const std::string& why) { return Error{"file_unreadable", path, "", why}; };
    const auto unreadable = [&] { return refused("cannot be read: " + std::generic_category().message(errno)); };
    const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK));
    if (!file) return unreadable();
    struct stat status {};
    if (::fstat(file.fd(), &status) != 0 || !S_ISREG(status.st_mode)) return refused("is no regular file");
    std::string text;
    std::array<char, 65536> chunk;
    ssize_t got = 1;
    while (got > 0 && text.size() <= most_bytes) {
        got = ::read(file.fd(), chunk.data(), std::min(chunk.size(), most_bytes + 1 - text.size()));
        if (got > 0) text.append(chunk.data(), static_cast<std::size_t>(got));
        if (got < 0 && errno == EINTR) got = 1;
    }
    if (got < 0) return unreadable();
    return text;
}

}  // namespace gonio
