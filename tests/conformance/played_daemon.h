// The front on a free port, with a daemon behind it that answers as much as the tests of connections need: a profile
// query is answered with its own text, a capture never, all else with a state.
#pragma once

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <vector>

#include "server/http/http_server.h"

namespace gonio::conformance {

class PlayedDaemon {
public:
    explicit PlayedDaemon(const HttpLimits& limits);
    ~PlayedDaemon() { front_.reset(); }

    std::uint16_t port() const { return front_->port(); }
    HttpServer& front() { return *front_; }
    unsigned clients() const;  // identified, as the demand counts them
    unsigned sessions_closed() const;
    unsigned captures_asked() const;
    // An H.264 frame for every lane that has viewers: an IDR where the lane wants one, everywhere with `key`.
    void publish(std::uint32_t scene_rev, bool key, std::size_t bytes);
    bool key_wanted() const;
    // Whether every client that ever identified has gone within this time.
    bool wait_until_alone(std::chrono::milliseconds time);
    bool wait_for_captures(unsigned count, std::chrono::milliseconds time);

private:
    bool take(SessionId session, const v1::ClientMessage& message);

    mutable std::mutex mutex_;
    std::condition_variable changed_;
    Demand demand_;
    unsigned closed_ = 0, captures_ = 0;
    std::unique_ptr<HttpServer> front_;
};

// Descriptors that this process has open.
std::size_t open_descriptors();
// As many as the system lets it have. Result: how many.
std::size_t raise_descriptor_limit();

}  // namespace gonio::conformance
