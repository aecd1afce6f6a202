#include "server/app/service.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <cstring>

namespace gonio {

Service::Service() {
    if (const char* path = std::getenv("NOTIFY_SOCKET")) socket_ = path;
    const char* pid = std::getenv("WATCHDOG_PID");
    if (pid != nullptr && std::strtol(pid, nullptr, 10) != getpid()) return;
    if (const char* time = std::getenv("WATCHDOG_USEC"))
        watchdog_ = std::chrono::microseconds(std::strtoll(time, nullptr, 10));
}

Service::~Service() {
    done_ = true;
    if (thread_.joinable()) thread_.join();
}

void Service::tell(std::string_view state) const {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (socket_.empty() || socket_.size() >= sizeof address.sun_path) return;
    std::memcpy(address.sun_path, socket_.data(), socket_.size());
    if (address.sun_path[0] == '@') address.sun_path[0] = '\0';  // Linux' abstract names
    const int fd = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (fd < 0) return;
    ::sendto(fd, state.data(), state.size(), MSG_NOSIGNAL | MSG_DONTWAIT, reinterpret_cast<const sockaddr*>(&address),
             static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + socket_.size()));
    ::close(fd);
}

void Service::watch(std::function<void(std::function<void()>)> ask_net) {
    if (watchdog_.count() <= 0 || thread_.joinable()) return;
    thread_ = std::thread([this, ask_net = std::move(ask_net)] {
        constexpr auto kStep = std::chrono::milliseconds(50);
        std::uint64_t rendered = 0, networked = 0;
        for (;;) {
            ask_net([this] { ++networked_; });
            // systemd.service(5): half the time that is asked for leaves room for one that comes late.
            for (auto slept = kStep * 0; slept < watchdog_ / 2; slept += kStep) {
                if (done_) return;
                std::this_thread::sleep_for(std::min<std::chrono::microseconds>(kStep, watchdog_ / 2));
            }
            const std::uint64_t now_rendered = rendered_, now_networked = networked_;
            if (now_rendered != rendered && now_networked != networked) tell("WATCHDOG=1");
            rendered = now_rendered;
            networked = now_networked;
        }
    });
}

}  // namespace gonio
