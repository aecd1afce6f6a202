// The fork-join pool of the render thread's SIMD work: thread_count() threads, the caller among them.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numeric>
#include <thread>
#include <vector>

#include "server/base/threads.h"

namespace gonio {

class Pool {
public:
    explicit Pool(int threads = thread_count()) {
        for (int i = 1; i < threads; ++i)
            workers_.emplace_back([this](const std::stop_token& stop) { wait_for_work(stop); });
    }
    ~Pool() {
        for (std::jthread& worker : workers_) worker.request_stop();
        ++generation_;
        generation_.notify_all();
    }
    Pool(const Pool&) = delete;
    Pool& operator=(const Pool&) = delete;

    // Runs job(0 … count − 1) in any order, on any of the threads, and returns when all are done. A thread that comes
    // too late for any of them is not waited for. Not reentrant; a job that throws ends the program.
    void run(int count, const std::function<void(int)>& job) {
        if (count <= 0 || ask()) return;
        job_ = &job;
        count_ = count;
        undone_ = count;
        untaken_ = count;
        ++generation_;
        generation_.notify_all();
        work(true);
        for (int left; (left = undone_.load()) != 0;) undone_.wait(left);
    }

    // Runs job(first, count) over `size` values, `chunk` at a time, the last time fewer; else as run().
    template <typename Job>
    void run_chunks(std::size_t size, std::size_t chunk, const Job& job) {
        run(static_cast<int>((size + chunk - 1) / chunk), [&](int i) {
            const std::size_t first = static_cast<std::size_t>(i) * chunk;
            job(first, std::min(chunk, size - first));
        });
    }

    // Result: start joined with job(first, count) of each chunk, in order.
    template <typename T, typename Job, typename Join>
    T reduce_chunks(std::size_t size, std::size_t chunk, T start, const Job& job, const Join& join) {
        std::vector<T> parts((size + chunk - 1) / chunk);
        run_chunks(size, chunk,
                   [&](std::size_t first, std::size_t count) { parts[first / chunk] = job(first, count); });
        return std::accumulate(parts.begin(), parts.end(), start, join);
    }

    // Asks before each job that the caller of run() takes. Once the answer is yes, jobs that nobody has begun are left
    // out, in this run and in all until the end of this object. One at a time.
    class Interruptible {
    public:
        Interruptible(Pool& pool, const std::function<bool()>& interrupted) : pool_(pool) {
            pool_.interrupted_ = &interrupted;
            pool_.stopped_ = false;
        }
        ~Interruptible() { pool_.interrupted_ = nullptr; }
        Interruptible(const Interruptible&) = delete;
        Interruptible& operator=(const Interruptible&) = delete;
        // Result: whether jobs may have been left out. Does not ask.
        bool stopped() const { return pool_.stopped_; }

    private:
        Pool& pool_;
    };

private:
    // Caller's thread. Result: whether nothing is to be begun any more.
    bool ask() noexcept { return interrupted_ != nullptr && (stopped_ = stopped_ || (*interrupted_)()); }
    void leave_out() noexcept {
        if (const int left = untaken_.exchange(0); left > 0) undone_ -= left;
    }
    void work(bool asks = false) noexcept {
        for (int left = untaken_.load(); left > 0;) {
            if (asks && ask()) return leave_out();
            if (!untaken_.compare_exchange_weak(left, left - 1)) continue;
            // Whoever has taken one is waited for: until it is done, `job_` and `count_` are those of its run.
            (*job_)(count_ - left);
            if (undone_.fetch_sub(1) == 1) undone_.notify_all();
            left = untaken_.load();
        }
    }
    void wait_for_work(const std::stop_token& stop) {
        for (std::uint32_t seen = 0;;) {
            generation_.wait(seen);
            seen = generation_.load();
            if (stop.stop_requested()) return;
            work();
        }
    }

    const std::function<bool()>* interrupted_ = nullptr;  // these two: the caller's alone
    bool stopped_ = false;
    const std::function<void(int)>* job_ = nullptr;
    int count_ = 0;
    std::atomic<int> untaken_{0}, undone_{0};
    std::atomic<std::uint32_t> generation_{0};
    std::vector<std::jthread> workers_;
};

}  // namespace gonio
