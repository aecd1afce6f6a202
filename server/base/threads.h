// How many threads share the work on pixels, rays and texels.
#pragma once

namespace gonio {

inline constexpr int kMostThreads = 1024;

// Result: what set_thread_count() said; else the processors that the process may run on, as taskset, a cpuset or a
// scheduler bound it (sched_getaffinity); at least 1. Any thread.
int thread_count();
// 1..kMostThreads; 0: as if it had never been called. Before the first loop; llvmpipe and lavapipe, which read the
// environment when GL starts, are told too. Main thread, while there is no other.
void set_thread_count(int threads);

}  // namespace gonio
