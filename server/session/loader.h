// The worker that reads files off the render thread: scenes, photometry; and encodes captured pictures.
#pragma once

#include <malloc.h>
#include <sys/resource.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <thread>

#include "server/base/queue.h"

namespace gonio {

// One thread, jobs in order. Jobs hold value copies and hand their results to a queue. At kMaxLoaderJobs waiting jobs,
// submit returns false.
inline constexpr std::size_t kMaxLoaderJobs = 64;
// After the last of some jobs. By then a scene that another took the place of has been freed, mostly in small pieces
// that glibc would keep: up to 64 MiB a thread.
inline constexpr std::chrono::seconds kTrimAfter{5};

class Loader {
public:
    Loader() : thread_([this] { work(); }) {}
    ~Loader() {  // jobs that wait are not begun any more
        ending_ = true;
        jobs_.close();
        thread_.join();
    }
    bool submit(std::function<void()> job) { return jobs_.push(std::move(job)); }

private:
    void work() {
        // Of a machine that is busy a third of what frames and encoders get (weights of nice 5 and 0: 335 and 1024).
        setpriority(PRIO_PROCESS, 0, 5);  // Linux: this thread and those that it starts
        for (bool trimmed = true;;) {
            auto job = trimmed ? jobs_.pop() : jobs_.pop_for(kTrimAfter);
            if (!job && (trimmed || jobs_.closed())) return;
            trimmed = !job;
            if (trimmed) {
                ::malloc_trim(0);
            } else if (!ending_.load()) {
                (*job)();
                job.reset();
            }
        }
    }
    std::atomic<bool> ending_{false};
    Queue<std::function<void()>> jobs_{kMaxLoaderJobs};
    std::thread thread_;
};

}  // namespace gonio
