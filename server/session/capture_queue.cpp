#include "server/session/capture_queue.h"

#include "server/session/capture_file.h"

namespace gonio {
void CaptureQueue::add(const Work& work, const Scene& scene, const CaptureRequest& request,
                       const GuardedRenderer& renderer, Replies& replies) {
    if (waiting_.size() >= most_) return replies.busy(work, "too many captures are waiting");
    auto job =
        renderer->begin_capture(scene, request.view, request.width_px, request.height_px, request.format == "exr");
    job->bounces = request.settings.bounces;
    job->samples_per_pixel = request.samples_per_pixel;
    waiting_.push_back({work, request.format, std::move(job)});
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

void CaptureQueue::advance(GuardedRenderer& renderer, Replies& replies) {
    if (waiting_.empty() || !renderer.ready(waiting_.front().job->scene)) return;
    bool complete = false;
    const bool there = renderer.draws([&] { complete = renderer->continue_capture(*waiting_.front().job); });
    if (!there || !complete) return;  // without the GPU it begins anew with the next renderer
    Capturing done = std::move(waiting_.front());
    waiting_.pop_front();
    ++rendered_;
    // Compressing takes long too: it is the loader's.
    auto job = std::make_shared<CaptureJob>(std::move(*done.job));
    const bool accepted = loader_.submit([work = done.work, format = done.format, job, send = send_] {
        v1::ServerMessage message = capture_message(*job->picture, job->view, format, job->scene.scene_rev);
        if (message.has_capture()) *message.mutable_capture()->mutable_report() = job->picture->report;
        message.set_request_id(work.message.request_id());
        send(work.session, std::move(message));
    });
    if (!accepted) replies.busy(done.work, "too many pictures are waiting to be written");
}

void CaptureQueue::forget_session(std::uint32_t session) {
    std::erase_if(waiting_, [&](const Capturing& capturing) { return capturing.work.session == session; });
    late_.forget([&](const Work& work) { return work.session == session; });
}

}  // namespace gonio
