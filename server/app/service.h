// The service manager (systemd) that started the program: told of its state, and that it lives (sd_notify(3)). Where
// there is none, nothing happens.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <string_view>
#include <thread>

namespace gonio {

class Service {
public:
    // Reads what the manager asks for (WATCHDOG_USEC, WATCHDOG_PID).
    Service();
    ~Service();
    Service(const Service&) = delete;
    Service& operator=(const Service&) = delete;

    // state: e.g. "READY=1" or "STATUS=…"; lines. Any thread. Goes to NOTIFY_SOCKET, where there is one.
    void tell(std::string_view state) const;
    // What the encoders were given, and what they are done with.
    struct Encoding {
        std::uint64_t given = 0, done = 0;
    };
    // Starts to tell that the program lives, as often as the manager asks; nothing where it does not ask. It is told
    // only while rendering, network and encoding all advanced since the last time. Rendering did where render() was
    // called, the network where `ask_net` had its answer, a call of what it was given. Encoding did where `encoding`
    // says that more is done, or that nothing is left to do. Both are called on a thread of its own.
    void watch(std::function<void(std::function<void()>)> ask_net, std::function<Encoding()> encoding);
    void render() { ++rendered_; }  // the render thread has come by

private:
    std::chrono::microseconds watchdog_{0};
    std::atomic<std::uint64_t> rendered_{0}, networked_{0};
    std::atomic<bool> done_{false};
    std::thread thread_;
};

}  // namespace gonio
