// SIGINT and SIGTERM -> an orderly end that takes at most two seconds; SIGHUP -> a reload.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <thread>

#include "server/base/descriptor.h"

namespace gonio {

// From the first signal on, whatever the other threads are at.
inline constexpr std::chrono::milliseconds kFarewellAfter{1000}, kEndAfter{1700};

class Signals {
public:
    // All are called on the signals' own thread.
    struct Actions {
        std::function<void()> stop;      // at the first SIGINT or SIGTERM
        std::function<void()> farewell;  // a second later, if the program still runs: clients must be told by now
        std::function<void()> last;      // right before it is ended with exit code 0, because something holds it up
        std::function<void()> discard;   // right before each end that does not wait: what must not stay behind
        std::function<void()> reload;    // at SIGHUP; like stop it must not wait, or nobody hears the next signal
    };
    // A second SIGINT or SIGTERM ends the program at once, with exit code 128 + its number.
    explicit Signals(Actions actions);
    ~Signals();
    Signals(const Signals&) = delete;
    Signals& operator=(const Signals&) = delete;

    // Before any thread is started: in all of them signals wait for a Signals.
    static void block();

private:
    void watch();

    Actions actions_;
    Descriptor fd_;
    std::atomic<bool> done_{false};
    std::thread thread_;
};

}  // namespace gonio
