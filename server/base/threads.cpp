#include "server/base/threads.h"

#include <sched.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <string>
#include <thread>

namespace gonio {
namespace {

std::atomic<int> chosen{0};

}  // namespace

int thread_count() {
    if (const int threads = chosen.load()) return threads;
    cpu_set_t processors;
    CPU_ZERO(&processors);
    if (sched_getaffinity(0, sizeof processors, &processors) == 0) return std::max(1, CPU_COUNT(&processors));
    return static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));  // more than 1,024 processors
}

void set_thread_count(int threads) {
    chosen = threads;
    if (threads > 0) setenv("LP_NUM_THREADS", std::to_string(threads).c_str(), 1);
}

}  // namespace gonio
