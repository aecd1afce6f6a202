// One item of the render thread's queue.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "protocol/schema/cue.pb.h"
#include "protocol/schema/gonio.pb.h"
#include "server/scene/apply.h"

namespace gonio {

inline constexpr std::size_t kMaxWork = 1024;  // messages waiting for the render thread; beyond it: "busy"

// What a server that follows another hears of it (server/follow/follower.h).
struct LeaderNews {
    std::shared_ptr<const Scene> scene;  // as the leader has it now; null: the connection is lost
    std::string boot;                    // State.boot of the leader
    bool anew = false;                   // its revisions began again: none of before counts
    v1::CuePlayback cues;                // State.cue_playback of the leader
};

struct Work {
    std::uint32_t session = 0;
    v1::ClientMessage message;
    Loaded loaded;                             // set when the loader has read the message's files
    std::optional<Error> failure;              // why it could not
    bool read = false;                         // the loader has been there
    std::shared_ptr<const Scene> prepared;     // of undo and redo: whose tables the loader has made
    Revision rev = 0;                          // of save_show: that was written
    std::shared_ptr<const LeaderNews> leader;  // no message of a client
    bool closed = false;                       // no message: the session has gone, and what it waits for with it
};

}  // namespace gonio
