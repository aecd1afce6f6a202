// What a long computation is told and tells: when to stop, how far it is, how many rays it took.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <stop_token>

namespace gonio::bake {

struct Work {
    std::stop_token stop;
    int threads = 0;                       // 0: thread_count()
    std::function<void(double)> progress;  // of a part, 0..1; any thread; may be empty
    std::atomic<std::uint64_t> rays{0};

    // Runs job(first, end) over `count` things in tiles. Result: false if a stop came before all were done.
    bool tiles(int count, int tile, const std::function<void(int, int)>& job);
};

}  // namespace gonio::bake
