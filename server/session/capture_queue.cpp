#include "server/session/capture_queue.h"

#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/measure.pb.h"
#include "server/scene/scene.h"
#include "server/session/capture_file.h"
#include "server/session/legend.h"

namespace gonio {
void CaptureQueue::add(const Work& work, const Scene& scene, const CaptureRequest& request,
                       const GuardedRenderer& renderer, Replies& replies, std::string warning) {
    if (waiting_.size() >= most_) return replies.busy(work, "too many captures are waiting");
    auto job =
        renderer->begin_capture(scene, request.view, request.width_px, request.height_px, request.format == "exr");
    job->bounces = request.settings.bounces;
    job->samples_per_pixel = request.samples_per_pixel;
    if (waiting_.empty()) {
        began_ns_ = monotonic_ns();
        tell_ns_ = began_ns_ + kTellNs;
    }
    waiting_.push_back({work, request.format, request.legend, std::move(warning), std::move(job)});
}

void CaptureQueue::add_late(const Work& work, Replies& replies) {
    if (!late_.add(work, work.message.capture().after_rev(), monotonic_ns()))
        replies.busy(work, "too many captures are waiting");
}

void CaptureQueue::refuse_overdue(Replies& replies) {
    if (late_.empty()) return;
    while (const auto work = late_.take_overdue(monotonic_ns()))
        replies.refuse(*work, {"timeout", "capture.after_rev", std::to_string(work->message.capture().after_rev()),
                               "the scene has not reached this revision within 30 s"});
}

void CaptureQueue::restart(const GuardedRenderer& renderer) {
    for (Capturing& capturing : waiting_) {
        const CaptureJob& job = *capturing.job;
        auto again =
            renderer->begin_capture(job.scene, job.view, job.picture->width_px, job.picture->height_px, job.raw);
        again->bounces = job.bounces;
        again->samples_per_pixel = job.samples_per_pixel;
        capturing.job = std::move(again);
    }
}

bool CaptureQueue::advance(GuardedRenderer& renderer, Replies& replies) {
    if (waiting_.empty()) return false;
    if (monotonic_ns() >= tell_ns_) tell_progress();
    if (renderer.ready(waiting_.front().job->scene) != Readiness::all) return false;
    bool complete = false;
    const bool there = renderer.draws([&] { complete = renderer->continue_capture(*waiting_.front().job); });
    if (!there || !complete) return true;  // without the GPU it begins anew with the next renderer
    answer(replies);
    return !waiting_.empty();
}

// Sends off the oldest capture, whose picture is complete.
void CaptureQueue::answer(Replies& replies) {
    Capturing done = std::move(waiting_.front());
    waiting_.pop_front();
    began_ns_ = monotonic_ns();
    if (!done.job->failure.empty()) return replies.refuse(done.work, {"unavailable", "capture", "", done.job->failure});
    ++rendered_;
    // Compressing takes long too: it is the loader's.
    auto job = std::make_shared<CaptureJob>(std::move(*done.job));
    const bool accepted = loader_.submit(
        [work = done.work, format = done.format, legend = done.legend, warning = done.warning, job, send = send_] {
            if (legend) draw_legend(*job->picture, job->scene, job->view);
            v1::ServerMessage message = capture_message(*job->picture, job->view, format, job->scene.scene_rev);
            if (message.has_capture()) *message.mutable_capture()->mutable_report() = job->picture->report;
            if (message.has_capture() && !warning.empty()) message.mutable_capture()->add_warnings(warning);
            message.set_request_id(work.message.request_id());
            send(work.session, std::move(message));
        });
    if (!accepted) replies.busy(done.work, "too many pictures are waiting to be written");
}

void CaptureQueue::tell_progress() {
    tell_ns_ = monotonic_ns() + kTellNs;
    for (std::size_t i = 0; i < waiting_.size(); ++i) {
        const Capturing& capturing = waiting_[i];
        const std::uint32_t request = capturing.work.message.request_id();
        if (request == 0) continue;
        v1::Progress progress;
        progress.set_request(request);
        progress.set_jobs_before(static_cast<std::uint32_t>(i));
        progress.set_unit("tiles");
        if (i == 0) {
            const int done = capturing.job->next_tile, all = capturing.job->columns() * capturing.job->rows();
            const double seconds = seconds_since(began_ns_);
            progress.set_samples(static_cast<std::uint32_t>(done));
            progress.set_total(static_cast<std::uint32_t>(all));
            progress.set_seconds(seconds);
            if (done > 0) progress.set_seconds_left(seconds * (all - done) / done);
        }
        send_(capturing.work.session, message_of(&v1::ServerMessage::mutable_progress, std::move(progress)));
    }
}

void CaptureQueue::forget_session(std::uint32_t session) {
    std::erase_if(waiting_, [&](const Capturing& capturing) { return capturing.work.session == session; });
    late_.forget([&](const Work& work) { return work.session == session; });
}

bool CaptureQueue::cancel(std::uint32_t session, std::uint32_t request_id) {
    const auto named = [&](const Work& work) {
        return work.session == session && work.message.request_id() == request_id;
    };
    const std::size_t late = late_.forget(named);
    return std::erase_if(waiting_, [&](const Capturing& capturing) { return named(capturing.work); }) + late > 0;
}

}  // namespace gonio
