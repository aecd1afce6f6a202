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
    // Starts to tell that the program lives, as often as the manager asks, while render() was called since the last
    // time and `ask_net` had its answer: a call of what it was given. Nothing where the manager does not ask.
    void watch(std::function<void(std::function<void()>)> ask_net);
    void render() { ++rendered_; }  // the render thread has come by

private:
    std::chrono::microseconds watchdog_{0};
    std::atomic<std::uint64_t> rendered_{0}, networked_{0};
    std::atomic<bool> done_{false};
    std::thread thread_;
};

}  // namespace gonio
