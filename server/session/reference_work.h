// Reference jobs: path-traced meters, captures and lux reports, one after the other on a thread of its own that gives
// way to everything else on the machine. A job holds the scene as it was when it was asked for. All functions are the
// render thread's.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <thread>
#include <variant>

#include "protocol/schema/messages.h"
#include "server/base/queue.h"
#include "server/session/lux_report.h"
#include "server/session/query.h"

namespace gonio {

inline constexpr std::size_t kMaxReferenceJobs = 8;  // waiting, beside the one that runs; beyond it: "busy"

struct ReferenceJob {
    std::uint32_t session = 0, request_id = 0;
    Scene scene;
    std::variant<MeterRequest, CaptureRequest, LuxReportRequest> request;
};

class ReferenceWork {
public:
    struct Outputs {
        // Answers and progress; the render thread and the worker call.
        std::function<void(std::uint32_t session, v1::ServerMessage)> reply;
        std::function<void()> ended;  // the worker: tick() has something to do
        // A denoised capture that ended with so few samples a pixel that the live picture looks better, which is to be
        // the answer. The render thread calls.
        std::function<void(const ReferenceJob&, std::uint32_t samples)> too_few;
    };
    explicit ReferenceWork(Outputs outputs);
    ~ReferenceWork();  // gives up what runs

    // Result: whether the job was taken; its session is answered when it is done.
    bool submit(ReferenceJob job);
    // Gives up the jobs of a client that went away.
    void forget_session(std::uint32_t session);
    // Result: whether there was such a job; it is given up, and its answer is the caller's.
    bool cancel(std::uint32_t session, std::uint32_t request_id);
    // Starts the next job where none runs, and tells waiting clients of the progress, twice a second.
    void tick();
    void add_counters(v1::Stats& stats) const;

private:
    struct Run;
    void work();
    // Result: how many jobs were given up, of those for which named(job).
    template <typename Named>
    std::size_t give_up(const Named& named);
    void tell_progress();

    Outputs out_;
    std::deque<ReferenceJob> waiting_;
    std::shared_ptr<Run> running_;
    Queue<std::shared_ptr<Run>> inbox_{1};
    std::int64_t told_ns_ = 0;
    std::uint32_t cancelled_ = 0;
    std::atomic<std::uint32_t> done_ = 0, passes_ = 0;  // the worker counts before it answers
    std::thread worker_;
};

}  // namespace gonio
