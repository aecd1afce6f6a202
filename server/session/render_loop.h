// What the render thread does next, and how long it may wait for it: commands, hands and fades, a frame, the encoders,
// captures, refinement. One turn after the other.
#pragma once

#include <chrono>
#include <cstdint>
#include <set>

#include "server/http/http_server.h"
#include "server/session/consoles.h"
#include "server/session/render_session.h"
#include "server/session/surface_input.h"
#include "server/stream/lane_feed.h"

namespace gonio {

// What other threads say to the render thread; outlives it.
struct Inbox {
    Queue<Work> queue{kMaxWork};
    Latest<Demand> demands;
    Latest<std::set<SessionId>> left;  // sessions whose end found the queue full
    Demand demand;                     // the newest that was taken; the render thread's own

    // What the HTTP server tells: into here.
    HttpServer::Callbacks callbacks();
};

class RenderLoop {
public:
    // frame_time: no frame begins sooner after the last.
    RenderLoop(Inbox& inbox, RenderSession& render_session, LaneFeed& feed, Consoles& consoles, SurfaceInput& hands,
               std::chrono::nanoseconds frame_time)
        : inbox_(inbox),
          render_session_(render_session),
          feed_(feed),
          consoles_(consoles),
          surface_input_(hands),
          frame_ns_(frame_time.count()) {}

    // Waits until something is due, at most 250 ms, and does it.
    void turn();

private:
    struct Plan {
        bool viewer = false;    // somebody can take a picture
        bool due = false;       // a frame is
        bool refining = false;  // the picture at rest gets better
        std::int64_t wait_ns = 0;
    };
    Plan plan(std::int64_t now_ns);
    std::optional<Work> wait(const Plan& plan, std::int64_t now_ns);
    void drain(std::optional<Work> first);

    Inbox& inbox_;
    RenderSession& render_session_;
    LaneFeed& feed_;
    Consoles& consoles_;
    SurfaceInput& surface_input_;
    std::int64_t frame_ns_;
    std::int64_t last_begin_ns_ = 0, last_moved_ns_ = 0;
};

}  // namespace gonio
