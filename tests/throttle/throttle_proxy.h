// A narrow, long line between a client and a server on this machine: bytes a second and delay both ways, in user space,
// with small socket buffers so that what the line does not carry stays with its sender.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <thread>

namespace gonio::test {

struct LineOptions {
    double bits_per_s = 3e6;              // each way
    std::chrono::milliseconds delay{20};  // each way
    int queue_bytes = 16 << 10;           // that wait before the line; more is not read from the sender
};

class ThrottleProxy {
public:
    // Listens on a free port of the loopback interface; every connection gets a line of its own to server_port.
    ThrottleProxy(std::uint16_t server_port, const LineOptions& options);
    ~ThrottleProxy();
    ThrottleProxy(const ThrottleProxy&) = delete;
    ThrottleProxy& operator=(const ThrottleProxy&) = delete;
    std::uint16_t port() const { return port_; }

private:
    void run();
    LineOptions options_;
    std::uint16_t server_port_, port_ = 0;
    int listener_ = -1;
    std::atomic<bool> stop_{false};
    std::thread thread_;
};

}  // namespace gonio::test
