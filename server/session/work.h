// One item of the render thread's queue.
#pragma once

#include <cstdint>
#include <optional>

#include "protocol/schema/gonio.pb.h"
#include "server/scene/apply.h"

namespace gonio {

inline constexpr std::size_t kMaxWork = 1024;  // messages waiting for the render thread; beyond it: "busy"

struct Work {
    std::uint32_t session = 0;
    v1::ClientMessage message;
    Loaded loaded;                 // set when the loader has read the message's files
    std::optional<Error> failure;  // why it could not
    bool read = false;             // the loader has been there
    Revision rev = 0;              // of save_show: that was written
    bool closed = false;           // no message: the session has gone, and what it waits for with it
};

}  // namespace gonio
