// Somebody who moves something all the time.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <string>
#include <thread>

#include "tests/unit/http_client.h"

namespace gonio::test {

// Gives a command sixty times a second until its end, over one connection: programs that start and end would leave
// pauses on a loaded machine.
class Mover {
public:
    using Move = std::function<void(v1::Command& command, int step)>;
    Mover(std::uint16_t port, Move move) : client_(port), move_(std::move(move)) {
        client_.join(kSubprotocolProto, false, false);
        thread_ = std::thread([this] {
            for (int step = 0; !stop_; ++step) {
                v1::ClientMessage message;
                move_(*message.mutable_command(), step);
                client_.say(message);
                std::this_thread::sleep_for(std::chrono::milliseconds(16));
            }
        });
    }
    ~Mover() {
        stop_ = true;
        thread_.join();
    }
    Mover(const Mover&) = delete;

private:
    Client client_;
    Move move_;
    std::atomic<bool> stop_{false};
    std::thread thread_;
};

}  // namespace gonio::test
