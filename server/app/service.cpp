#include "server/app/service.h"

#include <systemd/sd-daemon.h>

#include <algorithm>
#include <string>

namespace gonio {

Service::Service() {
    std::uint64_t asked_us = 0;
    if (sd_watchdog_enabled(0, &asked_us) > 0) watchdog_ = std::chrono::microseconds(asked_us);
}

Service::~Service() {
    done_ = true;
    if (thread_.joinable()) thread_.join();
}

void Service::tell(std::string_view state) const {
    sd_notify(0, std::string(state).c_str());  // what a manager does not take changes nothing here
}

void Service::watch(std::function<void(std::function<void()>)> ask_net, std::function<Encoding()> encoding) {
    if (watchdog_.count() <= 0 || thread_.joinable()) return;
    thread_ = std::thread([this, ask_net = std::move(ask_net), encoding = std::move(encoding)] {
        constexpr auto kStep = std::chrono::milliseconds(50);
        std::uint64_t rendered = 0, networked = 0, encoded = encoding().done;
        for (;;) {
            ask_net([this] { ++networked_; });
            // systemd.service(5): half the time that is asked for leaves room for one that comes late.
            for (auto slept = kStep * 0; slept < watchdog_ / 2; slept += kStep) {
                if (done_) return;
                std::this_thread::sleep_for(std::min<std::chrono::microseconds>(kStep, watchdog_ / 2));
            }
            const std::uint64_t now_rendered = rendered_, now_networked = networked_;
            const Encoding now = encoding();
            const bool encodes = now.done != encoded || now.done >= now.given;
            if (now_rendered != rendered && now_networked != networked && encodes) tell("WATCHDOG=1");
            rendered = now_rendered;
            networked = now_networked;
            encoded = now.done;
        }
    });
}

}  // namespace gonio
