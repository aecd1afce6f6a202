#include "server/trace/parallel.h"

#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

#include "server/base/threads.h"

namespace gonio::trace {

bool parallel(int count, int threads, bool idle, const std::stop_token& stop, const std::function<void(int)>& job) {
    std::atomic<int> next{0}, done{0};
    const auto work = [&] {
        if (idle) {
            sched_param none{};
            pthread_setschedparam(pthread_self(), SCHED_IDLE, &none);  // refused: the thread works at normal priority
        }
        for (int i; !stop.stop_requested() && (i = next.fetch_add(1)) < count;) {
            job(i);
            ++done;
        }
    };
    const int wanted = threads > 0 ? threads : thread_count();
    std::vector<std::jthread> workers;
    for (int t = 0; t < std::min(wanted, count); ++t) workers.emplace_back(work);
    workers.clear();  // joins
    return done == count;
}

}  // namespace gonio::trace
