// GET /v1/blobs/SHA256 of what lies in a file: one chunk is in memory at a time, read on the disk thread. Whoever
// fetches it checks the hash: the file may be another by now.
#include "server/http/sessions.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/write.hpp>
#include <cerrno>
#include <vector>

#include "server/base/descriptor.h"
#include "server/http/blobs.h"
#include "server/http/http_rules.h"

namespace gonio {
namespace {

constexpr std::size_t kBlobChunkBytes = 256 << 10;

class BlobSession final : public std::enable_shared_from_this<BlobSession> {
public:
    BlobSession(SessionRegistry& registry, Accepted accepted, Blob blob)
        : registry_(registry), accepted_(std::move(accepted)), blob_(std::move(blob)) {}

    void start() {
        on_disk([this] { return open(); });
    }

private:
    // Calls `work` on the disk thread, then writes what it has put into `chunk_`.
    template <typename Work>
    void on_disk(Work work) {
        registry_.calls.on_disk([self = shared_from_this(), work]() mutable {
            const bool good = work();
            const auto executor = self->accepted_.stream.get_executor();
            asio::post(executor, [self = std::move(self), good] {
                if (good) self->write();
            });
        });
    }
    bool open() {
        file_ = Descriptor(::open(blob_.file.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK));
        struct stat now {};
        const bool same = ::fstat(file_.fd(), &now) == 0 && static_cast<std::uint64_t>(now.st_size) == blob_.bytes;
        if (!same) file_ = Descriptor();  // it has changed since it was loaded
        const std::string head = file_
                                     ? "HTTP/1.1 200 OK\r\nContent-Type: application/octet-stream\r\nContent-Length: " +
                                           std::to_string(blob_.bytes) +
                                           "\r\nCache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n"
                                           "Connection: close\r\n\r\n"
                                     : "HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\nConnection: close\r\n\r\n";
        if (!file_) left_ = 0;
        registry_.count_answer(file_ ? 200 : 404);
        chunk_.assign(head.begin(), head.end());
        return true;
    }
    // Result: whether there was more; a file that is shorter by now ends the connection.
    bool read() {
        chunk_.resize(std::min<std::uint64_t>(kBlobChunkBytes, left_));
        ssize_t got = 0;
        do got = ::read(file_.fd(), chunk_.data(), chunk_.size());
        while (got < 0 && errno == EINTR);
        if (got <= 0) return false;
        chunk_.resize(static_cast<std::size_t>(got));
        left_ -= static_cast<std::uint64_t>(got);
        return true;
    }
    void write() {
        accepted_.stream.expires_after(registry_.options.limits.write_stall);
        accepted_.stream.async_write_some(asio::buffer(chunk_.data() + written_, chunk_.size() - written_),
                                          [self = shared_from_this()](error_code error, std::size_t bytes) {
                                              if (!error) self->on_written(bytes);
                                          });
    }
    void on_written(std::size_t bytes) {
        written_ += bytes;
        if (written_ < chunk_.size()) return write();  // who takes something has its time anew
        written_ = 0;
        if (left_ > 0 && !registry_.stopping) return on_disk([this] { return read(); });
        accepted_.stream.expires_after(std::chrono::seconds(1));
        accepted_.stream.async_shut_down([self = shared_from_this()](error_code) {});
    }

    SessionRegistry& registry_;
    Accepted accepted_;
    Blob blob_;
    std::uint64_t left_ = blob_.bytes;
    Descriptor file_;
    std::vector<char> chunk_;
    std::size_t written_ = 0;
};

}  // namespace

void start_blob_session(SessionRegistry& registry, Accepted accepted, Blob blob) {
    std::make_shared<BlobSession>(registry, std::move(accepted), std::move(blob))->start();
}

}  // namespace gonio
