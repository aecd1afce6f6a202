// Which descriptors wait for what, and whom that concerns. One thread.
#pragma once

#include <sys/epoll.h>

#include <array>
#include <functional>
#include <map>

#include "server/inputs/udp_socket.h"

namespace gonio {

class Watch {
public:
    Watch() : epoll_(epoll_create1(EPOLL_CLOEXEC)) {}
    // ready gets the EPOLL… events. It may add and remove descriptors, its own too.
    void add(int fd, std::function<void(std::uint32_t events)> ready, std::uint32_t events = EPOLLIN) {
        epoll_event event{events, {.fd = fd}};
        epoll_ctl(epoll_.fd(), EPOLL_CTL_ADD, fd, &event);
        ready_[fd] = std::move(ready);
    }
    void change(int fd, std::uint32_t events) {
        epoll_event event{events, {.fd = fd}};
        epoll_ctl(epoll_.fd(), EPOLL_CTL_MOD, fd, &event);
    }
    void remove(int fd) {
        epoll_ctl(epoll_.fd(), EPOLL_CTL_DEL, fd, nullptr);
        ready_.erase(fd);
    }
    // Serves what is ready, or waits for so long.
    void wait(int timeout_ms) {
        std::array<epoll_event, 64> events;
        const int count = epoll_wait(epoll_.fd(), events.data(), static_cast<int>(events.size()), timeout_ms);
        for (int i = 0; i < count; ++i) {
            const auto found = ready_.find(events[static_cast<std::size_t>(i)].data.fd);
            if (found == ready_.end()) continue;  // an earlier one removed it
            const auto ready = found->second;
            ready(events[static_cast<std::size_t>(i)].events);
        }
    }

private:
    Descriptor epoll_;
    std::map<int, std::function<void(std::uint32_t)>> ready_;
};

}  // namespace gonio
