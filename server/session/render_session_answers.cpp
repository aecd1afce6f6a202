// What a RenderSession answers to questions: meters, pictures, reports, counters.
#include <algorithm>
#include <ctime>
#include <utility>

#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/measure.pb.h"
#include "protocol/schema/report.pb.h"
#include "protocol/schema/session.pb.h"
#include "server/scene/limits.h"
#include "server/scene/scene.h"
#include "server/session/beam.h"
#include "server/session/profile_summary.h"
#include "server/session/render_session.h"
#include "server/trace/denoise.h"

namespace gonio {

void RenderSession::answer_meter(const Work& work) {
    measure(work, check_meter(work.message.meter()));
}

void RenderSession::measure(const Work& work, Result<MeterRequest> request) {
    if (!request) return replies_.refuse(work, request.error());
    if (request->quality == Quality::reference) return submit_reference(work, std::move(*request));
    if (const auto lacking = check_sun(scene_, request->quality)) return replies_.refuse(work, *lacking);
    if (request->quality == Quality::rsm && scene_.lights.size() > kMostLayers)
        return replies_.refuse(
            work, {"too_many_lights", "meter.quality", "rsm",
                   "reflective shadow maps are made of at most " + std::to_string(kMostLayers) + " lights"});
    meters_.add(work, scene_, std::move(*request), replies_);
}

void RenderSession::answer_pick(const Work& work) {
    auto picked = pick_at(scene_, work.message.pick());
    if (!picked) return replies_.refuse(work, picked.error());
    // Without a sun that is on the reading would be wrong: the place is told alone.
    if (!picked->pick.hit() || check_sun(scene_, Quality::interactive))
        return replies_.answer(work, message_of(&v1::ServerMessage::mutable_pick, picked->pick));
    meters_.add(work, scene_, std::move(*picked), replies_);
}

void RenderSession::answer_beam(const Work& work) {
    auto beam = beam_of(scene_, work.message.beam());
    if (!beam) return replies_.refuse(work, beam.error());
    replies_.answer(work, message_of(&v1::ServerMessage::mutable_beam, std::move(*beam)));
}

void RenderSession::answer_library(const Work& work) {
    auto found = library_->find(work.message.library());
    if (!found) return replies_.refuse(work, found.error());
    replies_.answer(work, message_of(&v1::ServerMessage::mutable_library, std::move(*found)));
}

void RenderSession::answer_capture(const Work& work) {
    if (const v1::CaptureQuery& query = work.message.capture(); is_scene_format(query.format())) {
        if (const auto refused = check_scene_file(query)) return replies_.refuse(work, *refused);
        if (query.after_rev() > scene_.scene_rev) return captures_.add_late(work, replies_);
        return scene_files_.add(work, scene_, replies_);
    }
    auto request = check_capture(scene_, work.message.capture());
    if (!request) return replies_.refuse(work, request.error());
    if (work.message.capture().after_rev() > scene_.scene_rev) return captures_.add_late(work, replies_);
    if (request->quality == Quality::reference) return submit_reference(work, std::move(*request));
    captures_.add(work, scene_, *request, renderer_, replies_);
}

void RenderSession::capture_instead(const ReferenceJob& job, std::uint32_t samples) {
    Work work{.session = job.session};
    work.message.set_request_id(job.request_id);
    if (!renderer_) return replies_.refuse(work, kGpuLost);
    captures_.add(work, job.scene, std::get<CaptureRequest>(job.request), renderer_, replies_,
                  "max_seconds ended the reference at " + std::to_string(samples) +
                      " samples a pixel. Filtered from fewer than " + std::to_string(trace::kLeastDenoised) +
                      " it looks worse than the live picture, which is here in its place.");
}

void RenderSession::submit_reference(const Work& work,
                                     std::variant<MeterRequest, CaptureRequest, LuxReportRequest> request) {
    if (!reference_.submit({work.session, work.message.request_id(), scene_, std::move(request)}))
        replies_.busy(work, "too many reference jobs are waiting");
}

void RenderSession::cancel(const Work& work) {
    const std::uint32_t request = work.message.cancel().request();
    const bool found =
        request != 0 && (captures_.cancel(work.session, request) || meters_.cancel(work.session, request) ||
                         reference_.cancel(work.session, request));
    if (!found)
        return replies_.refuse(work, {"not_found", "cancel.request", std::to_string(request),
                                      "no meter or capture of this request is waiting for its answer"});
    Work given_up{.session = work.session};
    given_up.message.set_request_id(request);
    v1::Result result;
    result.set_code("cancelled");
    result.set_message("it was given up as this client asked");
    result.set_scene_rev(scene_.scene_rev);
    replies_.answer(given_up, message_of(&v1::ServerMessage::mutable_result, std::move(result)));
    replies_.ok(work);
}

void RenderSession::answer_report(const Work& work) {
    const std::uint32_t rev = work.message.report().rev();
    if (rev > scene_.scene_rev)
        return replies_.refuse(work, {"invalid_argument", "report.rev", std::to_string(rev),
                                      "the scene is at revision " + std::to_string(scene_.scene_rev)});
    if (reports_.full()) return replies_.busy(work, "too many reports are waited for");
    // rev 0 asks for the scene as it stands: one more frame, clean if nothing moved.
    if (rev == 0) return reports_.wait(work, scene_.scene_rev);
    const v1::FrameReport* const report = reports_.find(rev);
    if (report == nullptr) return reports_.wait(work, rev);
    replies_.answer(work, message_of(&v1::ServerMessage::mutable_report, *report));
}

void RenderSession::answer_profile(const Work& work) {
    const std::string& name = work.message.profile().light();
    const auto light = std::ranges::find(scene_.lights, name, &Light::name);
    if (light == scene_.lights.end())
        return replies_.refuse(work, {"not_found", "profile.light", name, "there is no light of this name"});
    if (light->sun)
        return replies_.refuse(work, {"unsupported", "profile.light", name, "this light is a sun: it has no candela"});
    replies_.answer(work, message_of(&v1::ServerMessage::mutable_profile, profile_reply(*light)));
}

void RenderSession::answer_learn(const Work& work) {
    if (const auto refused = roles_.refuses_change(work.session, "learn")) return replies_.refuse(work, *refused);
    const double timeout_s = work.message.learn().timeout_s();
    if (timeout_s != 0 && !(timeout_s >= 0.1 && timeout_s <= 600))
        return replies_.refuse(
            work, {"invalid_argument", "learn.timeout_s", print_number(timeout_s), "must be a number from 0.1 to 600"});
    out_.learn(work.session, work.message.request_id(), timeout_s == 0 ? 30 : timeout_s);
}

void RenderSession::answer_lux_report(const Work& work) {
    const std::time_t now = std::time(nullptr);
    std::tm utc{};
    gmtime_r(&now, &utc);
    char date[32];
    std::strftime(date, sizeof date, "%Y-%m-%d %H:%M UTC", &utc);
    auto request = check_lux_report(scene_, work.message.lux_report(), date);
    if (!request) return replies_.refuse(work, request.error());
    submit_reference(work, std::move(*request));
}

v1::Stats RenderSession::stats() {
    v1::Stats stats = out_.counters();
    *stats.mutable_sources() = out_.sources();
    stats.set_frames_rendered(frames_rendered_);
    stats.set_captures(captures_.rendered());
    stats.set_commands_refused(replies_.refused());
    stats.set_scene_rev(scene_.scene_rev);
    stats.set_settled(stats.settled() && settled());
    stats.set_renderer(renderer_name_);
    stats.set_gpu_resets(gpu_resets_);
    stats.set_picture_error(picture_error_);
    if (renderer_) *stats.mutable_transport() = renderer_->transport_stats();
    stats.set_transport_ready(stats.transport().ready());
    reference_.add_counters(stats);
    return stats;
}

}  // namespace gonio
