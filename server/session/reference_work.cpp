#include "server/session/reference_work.h"

#include <pthread.h>
#include <sched.h>

#include <algorithm>

#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/measure.pb.h"
#include "protocol/schema/session.pb.h"
#include "server/scene/scene.h"
#include "server/session/capture_file.h"
#include "server/session/legend.h"
#include "server/session/meter_reply.h"
#include "server/session/replies.h"
#include "server/session/traced_capture.h"
#include "server/session/traced_meters.h"
#include "server/trace/denoise.h"

namespace gonio {
// One job while the worker has it.
struct ReferenceWork::Run {
    ReferenceJob job;
    std::stop_source stop;
    std::int64_t started_ns = 0;
    Latest<trace::Progress> news;        // from the worker
    trace::Progress reached;             // the render thread's
    std::atomic<bool> answered = false;  // or given up: whoever sets it answers
    std::uint32_t too_few = 0;           // the worker's, before it ended: samples a pixel; 0: enough
    std::atomic<bool> ended = false;
};

ReferenceWork::ReferenceWork(Outputs outputs) : out_(std::move(outputs)), worker_([this] { work(); }) {}

template <typename Named>
std::size_t ReferenceWork::give_up(const Named& named) {
    std::size_t jobs = std::erase_if(waiting_, named);
    if (running_ && named(running_->job) && !running_->answered.exchange(true)) {
        running_->stop.request_stop();
        ++jobs;
    }
    cancelled_ += static_cast<std::uint32_t>(jobs);
    return jobs;
}

ReferenceWork::~ReferenceWork() {
    give_up([](const ReferenceJob&) { return true; });
    inbox_.close();
    worker_.join();
}

bool ReferenceWork::submit(ReferenceJob job) {
    if (waiting_.size() >= kMaxReferenceJobs) return false;
    if (!running_ && waiting_.empty()) told_ns_ = monotonic_ns();  // what is done by then needs no progress
    waiting_.push_back(std::move(job));
    tick();
    return true;
}

void ReferenceWork::forget_session(std::uint32_t session) {
    give_up([&](const ReferenceJob& job) { return job.session == session; });
}

bool ReferenceWork::cancel(std::uint32_t session, std::uint32_t request_id) {
    return give_up([&](const ReferenceJob& job) { return job.session == session && job.request_id == request_id; }) > 0;
}

void ReferenceWork::tick() {
    if (running_ && running_->ended.load()) {
        if (running_->too_few > 0 && !running_->answered.exchange(true)) {
            ++done_;
            out_.too_few(running_->job, running_->too_few);
        }
        running_.reset();
    }
    if (!running_ && !waiting_.empty()) {
        running_ = std::make_shared<Run>();
        running_->job = std::move(waiting_.front());
        waiting_.pop_front();
        running_->started_ns = monotonic_ns();
        inbox_.push(running_);
    }
    const std::int64_t now = monotonic_ns();
    if (!running_ || now - told_ns_ < kTellNs) return;
    told_ns_ = now;
    tell_progress();
}

void ReferenceWork::tell_progress() {
    if (const auto news = running_->news.try_take()) running_->reached = *news;
    const auto tell = [&](const ReferenceJob& job, v1::Progress progress) {
        if (job.request_id == 0) return;
        progress.set_request(job.request_id);
        const auto* meter = std::get_if<MeterRequest>(&job.request);
        const bool grid = meter != nullptr && meter->grid;
        const auto* report = std::get_if<LuxReportRequest>(&job.request);
        progress.set_unit(grid ? "points" : report != nullptr ? "parts" : "samples");
        if (grid) progress.set_total(static_cast<std::uint32_t>(meter->points.size()));
        if (report != nullptr) progress.set_total(static_cast<std::uint32_t>(report->parts()));
        out_.reply(job.session, message_of(&v1::ServerMessage::mutable_progress, std::move(progress)));
    };
    v1::Progress progress;
    progress.set_samples(running_->reached.passes);
    progress.set_noise_ratio(running_->reached.noise < 1.0 ? running_->reached.noise : 0.0);  // 0: not known yet
    progress.set_seconds(seconds_between(running_->started_ns, told_ns_));
    if (running_->reached.seconds_left) progress.set_seconds_left(*running_->reached.seconds_left);
    if (!running_->stop.stop_requested()) tell(running_->job, progress);
    for (std::size_t i = 0; i < waiting_.size(); ++i) {
        v1::Progress wait;
        wait.set_jobs_before(static_cast<std::uint32_t>(i + 1));
        tell(waiting_[i], wait);
    }
}

void ReferenceWork::add_counters(v1::Stats& stats) const {
    stats.set_reference_waiting(static_cast<std::uint32_t>(waiting_.size()));
    stats.set_reference_running(running_ && !running_->ended.load() ? 1 : 0);
    stats.set_reference_done(done_.load());
    stats.set_reference_cancelled(cancelled_);
    stats.set_reference_passes(passes_.load());
}

// Result: the settings with what is left of max_seconds: making the scene ready counts too.
static trace::Settings settings_since(std::int64_t began_ns, trace::Settings settings) {
    constexpr double kLeast = 1e-3;
    if (settings.max_seconds > 0.0)
        settings.max_seconds = std::max(kLeast, settings.max_seconds - seconds_since(began_ns));
    return settings;
}

void ReferenceWork::work() {
    // What this thread starts inherits its scheduling: the threads that build the acceleration structure too.
    const sched_param none{};
    pthread_setschedparam(pthread_self(), SCHED_IDLE, &none);
    // Of the last job: the next one takes over what still fits. It keeps a scene that was replaced until then.
    std::shared_ptr<const trace::World> latest;
    while (const auto next = inbox_.pop()) {
        Run& run = **next;
        const ReferenceJob& job = run.job;
        const std::stop_token stop = run.stop.get_token();
        std::uint32_t counted = 0;
        const auto note = [&](const trace::Progress& reached) {
            passes_ += reached.passes - counted;
            counted = reached.passes;
            run.news.put(reached);
        };
        std::shared_ptr<const trace::World> world;
        const std::int64_t began_ns = monotonic_ns();
        if (!stop.stop_requested()) latest = world = trace::make_world(job.scene, latest.get());
        v1::ServerMessage message;
        if (const auto* meter = std::get_if<MeterRequest>(&job.request)) {
            if (world) {
                MeterRequest request = *meter;
                request.settings = settings_since(began_ns, meter->settings);
                auto readings = traced_readings(*world, request, stop, note);
                message = meter->answer ? meter->answer(std::move(readings))
                                        : meter_message(std::move(readings), meter->grid);
            }
        } else if (const auto* report = std::get_if<LuxReportRequest>(&job.request)) {
            if (world) message = traced_report(world, job.scene, *report, stop, note);
        } else if (world) {
            CaptureRequest capture = std::get<CaptureRequest>(job.request);
            capture.settings = settings_since(began_ns, capture.settings);
            auto traced = trace_capture(world, job.scene, capture, stop, note);
            if (traced && capture.denoise && traced->progress.passes < trace::kLeastDenoised) {
                run.too_few = traced->progress.passes;
                traced.reset();  // the answer is the live picture
            }
            if (traced && capture.legend) draw_legend(traced->picture, job.scene, capture.view);
            if (traced) message = capture_message(traced->picture, capture.view, capture.format, job.scene.scene_rev);
            if (message.has_capture()) {
                v1::CaptureResult& result = *message.mutable_capture();
                const trace::Progress& progress = traced->progress;
                result.set_samples(progress.passes);
                if (progress.passes >= trace::kLeastPassesOfNoise || progress.noise_reached)
                    result.set_noise_ratio(progress.noise);
                result.set_noise_reached(progress.noise_reached);
                result.set_denoised(traced->denoised_noise.has_value());
                if (traced->denoised_noise) result.set_denoised_noise_ratio(*traced->denoised_noise);
            }
        }
        const bool answered = run.too_few == 0 && !run.answered.exchange(true);
        if (answered) ++done_;
        run.ended = true;
        if (answered && job.request_id != 0) {
            message.set_request_id(job.request_id);
            out_.reply(job.session, std::move(message));
        }
        out_.ended();
    }
}

}  // namespace gonio
