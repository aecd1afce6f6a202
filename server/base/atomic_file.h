// Files that are there whole or not at all.
#pragma once

#include <string>
#include <string_view>
#include <utility>

#include "ies/core/result.h"
#include "server/base/descriptor.h"

namespace gonio {

// Result: the error of a path that cannot be written; the reason is an errno.
Error unwritable(const std::string& path, int reason);

// Writes PATH.part beside the file, brings it to the disk and renames it: whoever reads PATH, also after a crash, gets
// the old content or the new one. A file that is replaced hands on its permissions. Errors: "file_unwritable" with the
// path and the system's reason; PATH is as before.
Result<bool> write_file_atomically(const std::string& path, std::string_view bytes);
// The same by way of a name of the caller's, in the same folder.
Result<bool> write_file_by_way_of(const std::string& part, const std::string& path, std::string_view bytes);
// Brings the names in a file's folder to the disk. Not every file system can say so; then the rename itself has to do.
void sync_folder_of(const std::string& path);

// Result: what the path leads to where it is a symbolic link, or a chain of them; else the path. It need not exist.
std::string behind_links(std::string path);

// Holds PATH.lock (flock(2)), which stays on the disk, against other processes until its end.
class FileLock {
public:
    // Errors: "busy": another process holds it. Where it cannot be made, or the disk knows no locks, nothing is held,
    // and why_not() says why; where the path is no regular file, nothing is made.
    static Result<FileLock> take(const std::string& path);
    std::string why_not() const;

private:
    FileLock(Descriptor file, int reason) : file_(std::move(file)), reason_(reason) {}
    Descriptor file_;
    int reason_;
};

// Renames a file to the first free one of PATH<ending>, PATH<ending>-2 … -99 (the last one is replaced). Result: its
// new name. Errors: "file_unwritable".
Result<std::string> set_file_aside(const std::string& path, const std::string& ending);

// Gives a file such a name as well, so that its content outlives being replaced; one that it has from earlier will do.
// Where the disk knows no second names it is renamed. Result and errors: as of set_file_aside.
Result<std::string> keep_file_aside(const std::string& path, const std::string& ending);

}  // namespace gonio
