// SIGINT and SIGTERM -> a stop, for jobs; a server has signals.h.
#pragma once

#include <pthread.h>
#include <atomic>
#include <csignal>
#include <ctime>
#include <stop_token>
#include <thread>

namespace gonio {

// Waits for SIGINT or SIGTERM, which are blocked in all threads.
class StopOnSignal {
public:
    explicit StopOnSignal(std::stop_source& stop) {
        thread_ = std::jthread([this, &stop] {
            const sigset_t set = waited_for();
            const timespec tick{0, 100'000'000};
            while (!done_) {
                if (sigtimedwait(&set, nullptr, &tick) > 0) stop.request_stop();
            }
        });
    }
    ~StopOnSignal() { done_ = true; }
    StopOnSignal(const StopOnSignal&) = delete;
    StopOnSignal& operator=(const StopOnSignal&) = delete;

    // Before any thread is started. What a closed pipe or a full disk says is said by the call itself.
    static void block() {
        const sigset_t set = waited_for();
        pthread_sigmask(SIG_BLOCK, &set, nullptr);
        std::signal(SIGPIPE, SIG_IGN);
        std::signal(SIGXFSZ, SIG_IGN);
    }

private:
    static sigset_t waited_for() {
        sigset_t set;
        sigemptyset(&set);
        sigaddset(&set, SIGINT);
        sigaddset(&set, SIGTERM);
        return set;
    }

    std::atomic<bool> done_{false};
    std::jthread thread_;
};

}  // namespace gonio
