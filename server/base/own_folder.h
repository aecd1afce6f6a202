// A private folder that goes with the process that made it, also where that one is killed.
#pragma once

#include <string>

#include "ies/core/result.h"
#include "server/base/descriptor.h"

namespace gonio {

// While `held` is open no other process removes the folder. Whoever made it removes it at the end.
struct OwnFolder {
    std::string path;
    Descriptor held;
};

// Makes PARENT/PREFIX-XXXXXX, which only this user may read, and holds it by flock(2). First removes what processes of
// this user that are gone, because they were killed, left there under the prefix. Where the disk knows no locks nothing
// is removed. Errors: "file_unwritable" with the path and the system's reason.
Result<OwnFolder> make_own_folder(const std::string& parent, const std::string& prefix);

}  // namespace gonio
