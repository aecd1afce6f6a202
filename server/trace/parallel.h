// Loops over independent jobs on several threads.
#pragma once

#include <functional>
#include <stop_token>

namespace gonio::trace {

// Runs job(0 … count − 1) in any order on `threads` threads (0: thread_count()) and waits for them. idle: they yield to
// everything else on the machine (SCHED_IDLE). Result: false if a stop came before all were done.
bool parallel(int count, int threads, bool idle, const std::stop_token& stop, const std::function<void(int)>& job);

}  // namespace gonio::trace
