// The folder of uploaded files: names, bounds, and whole files only. No sockets. After open() everything is the disk
// thread's, but folder() and discard().
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "ies/core/result.h"
#include "server/base/descriptor.h"
#include "server/http/http_limits.h"

namespace gonio {

// A file that is being written under a name of its own; it appears under the right one when it is complete.
struct UploadPart {
    std::string name, temporary_name;
    int fd = -1;
    std::uint64_t bytes = 0;
};

class UploadStore {
public:
    // folder: made if it is missing, and kept; what lies in it counts. Empty: a fresh one that only this user may read,
    // in $XDG_RUNTIME_DIR or the folder for temporary files, removed with its content at the end. Those that killed
    // servers left there are removed first (own_folder.h). Errors: "file_unwritable"; "busy" where another store, of
    // whatever process, holds the folder.
    static Result<std::unique_ptr<UploadStore>> open(const std::string& folder, const HttpLimits& limits);
    ~UploadStore();
    UploadStore(const UploadStore&) = delete;
    UploadStore& operator=(const UploadStore&) = delete;

    const std::string& folder() const { return folder_; }
    // Removes a private folder with its content, for good; any thread, also while the disk thread writes. Nothing can
    // be uploaded after it. Result: false where it is still there after that time.
    bool discard(std::chrono::milliseconds time) const;

    // declared_bytes: what the client said it sends, 0 if it said nothing. Errors: "invalid_argument" (name),
    // "too_large" (one file), "full" (all files, their number, the disk), "file_unwritable".
    Result<UploadPart> begin(const std::string& name, std::uint64_t declared_bytes);
    // Errors as of begin; the part is to be abandoned then.
    Result<bool> write(UploadPart& part, std::span<const char> bytes);
    // Result: true if a file of the name was replaced. After it, and after abandon(), the part is closed.
    Result<bool> finish(UploadPart& part);
    void abandon(UploadPart& part);
    // Result: whether there was a file of the name.
    bool remove(const std::string& name);

private:
    UploadStore(std::string folder, bool own, Descriptor fd, const HttpLimits& limits);
    std::optional<std::uint64_t> size_of(const std::string& name) const;  // nothing where there is no such file
    void count(bool held);

    std::string folder_;
    bool own_;
    Descriptor fd_;  // of the folder, which it holds against other servers
    HttpLimits limits_;
    std::uint64_t bytes_ = 0;  // of whole files and of parts
    unsigned files_ = 0, next_part_ = 0;
};

}  // namespace gonio
