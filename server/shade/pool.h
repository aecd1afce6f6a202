// The fork-join pool of the render thread's SIMD work: as many threads as cores, the caller among them.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <thread>
#include <vector>

namespace gonio::shade {

class Pool {
public:
    explicit Pool(int threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()))) {
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

    // Runs job(0 … count − 1) in any order, on any of the threads, and returns when all are done. Not reentrant.
    void run(int count, const std::function<void(int)>& job) {
        if (count <= 0) return;
        job_ = &job;
        count_ = count;
        next_ = 0;
        busy_ = static_cast<int>(workers_.size());
        ++generation_;
        generation_.notify_all();
        work();
        for (int left; (left = busy_.load()) != 0;) busy_.wait(left);
    }

private:
    void work() {
        for (int i; (i = next_.fetch_add(1)) < count_;) (*job_)(i);
    }
    void wait_for_work(const std::stop_token& stop) {
        for (std::uint32_t seen = 0;;) {
            generation_.wait(seen);
            seen = generation_.load();
            if (stop.stop_requested()) return;
            work();
            if (busy_.fetch_sub(1) == 1) busy_.notify_all();
        }
    }

    const std::function<void(int)>* job_ = nullptr;
    int count_ = 0;
    std::atomic<int> next_{0}, busy_{0};
    std::atomic<std::uint32_t> generation_{0};
    std::vector<std::jthread> workers_;
};

}  // namespace gonio::shade
