#include "server/app/signals.h"

#include <dirent.h>
#include <poll.h>
#include <pthread.h>
#include <sched.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <optional>

namespace gonio {
namespace {

sigset_t waited_for() {
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, SIGINT);
    sigaddset(&set, SIGTERM);
    sigaddset(&set, SIGHUP);
    return set;
}

// Threads that give way to everything else get no time on a busy machine, not even to end: seconds went by. Who may not
// change their policy (RLIMIT_NICE) waits for them as before.
void hurry_idle_threads() {
    DIR* const threads = opendir("/proc/self/task");
    if (threads == nullptr) return;
    while (const dirent* entry = readdir(threads)) {
        const pid_t thread = static_cast<pid_t>(std::atoi(entry->d_name));
        const sched_param none{};
        if (thread > 0 && sched_getscheduler(thread) == SCHED_IDLE) sched_setscheduler(thread, SCHED_OTHER, &none);
    }
    closedir(threads);
}

}  // namespace

void Signals::block() {
    const sigset_t set = waited_for();
    pthread_sigmask(SIG_BLOCK, &set, nullptr);
    std::signal(SIGPIPE, SIG_IGN);
    std::signal(SIGXFSZ, SIG_IGN);  // a file that must not grow is an error of the write, not the end
}

Signals::Signals(Actions actions) : actions_(std::move(actions)) {
    const sigset_t set = waited_for();
    fd_ = Descriptor(signalfd(-1, &set, SFD_CLOEXEC));
    thread_ = std::thread([this] { watch(); });
}

Signals::~Signals() {
    done_ = true;
    thread_.join();
}

void Signals::watch() {
    using Clock = std::chrono::steady_clock;
    std::optional<Clock::time_point> first;
    bool told = false;
    while (!done_.load()) {
        pollfd ready{fd_.fd(), POLLIN, 0};
        signalfd_siginfo signal{};
        if (poll(&ready, 1, first ? 20 : 100) > 0 && read(fd_.fd(), &signal, sizeof signal) == sizeof signal) {
            if (signal.ssi_signo == SIGHUP) {
                actions_.reload();
            } else if (first) {
                actions_.discard();
                hurry_idle_threads();
                _exit(128 + static_cast<int>(signal.ssi_signo));
            } else {
                first = Clock::now();
                actions_.stop();
                hurry_idle_threads();
            }
        }
        if (!first || done_.load()) continue;
        if (!told && Clock::now() - *first >= kFarewellAfter) {
            told = true;
            actions_.farewell();
        }
        if (Clock::now() - *first >= kEndAfter) {
            actions_.last();
            actions_.discard();
            hurry_idle_threads();
            _exit(0);
        }
    }
}

}  // namespace gonio
