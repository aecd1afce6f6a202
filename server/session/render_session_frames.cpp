// Frames of the live picture: begun, made better while nothing moves, and told when they are done.
#include <algorithm>
#include <utility>

#include <spdlog/spdlog.h>

#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/report.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/render/graph.h"
#include "server/scene/scene.h"
#include "server/session/render_session.h"

namespace gonio {

void RenderSession::begin_frame(std::int64_t drained_ns) {
    await_assets();
    renderer_.draws([&] {
        if (renderer_->frames_in_flight() >= kMaxFramesInFlight) take_frame(true);
        // A frame that lights nothing anew keeps the picture's size, and with it what the picture is made of.
        const std::int64_t now_ns = monotonic_ns();
        if (lights_anew() || owes()) renderer_->set_quality_level(budget_.choose(now_ns));
        renderer_->begin_frame(scene_, drained_ns);
        if (rendered_rev_ != scene_.scene_rev) changed_ns_ = now_ns;
        rendered_rev_ = scene_.scene_rev;
        flashed_ = false;
        better_ = false;
        refined_ = renderer_->refined(scene_);
    });
}

void RenderSession::set_watched(bool watched) {
    if (std::exchange(watched_, watched) != watched && renderer_) renderer_->set_watched(watched);
}

bool RenderSession::lights_anew() const {
    Revision newest = std::max({scene_.geometry_rev, scene_.camera_rev, scene_.lights_rev});
    for (const Light& light : scene_.lights)
        newest = std::max({newest, light.position_rev, light.aim_rev, light.profile_rev});
    return newest > rendered_rev_;
}

std::int64_t RenderSession::rest_in_ns() const {
    if (!watched_) return INT64_MAX;
    const std::int64_t now_ns = monotonic_ns(), owes_ns = budget_.owes_in_ns(now_ns);
    return refinable() ? std::min(owes_ns, changed_ns_ + Budget::kRestNs - now_ns) : owes_ns;
}

void RenderSession::refine() {
    renderer_.draws([&] { better_ = renderer_->refine(scene_, [this] { return queue_.pressing(); }); });
}

void RenderSession::finish_frames(bool wait) {
    renderer_.draws([&] {
        while (take_frame(wait)) {
        }
    });
}

// Why the newest picture is not as the scene is; empty: it is.
void RenderSession::note_picture(const std::string& failure) {
    if (failure == picture_error_) return;
    picture_error_ = failure;
    if (!failure.empty()) spdlog::error("the picture cannot be made: {}", failure);
    v1::StateChanged change;
    change.set_scene_rev(scene_.scene_rev);
    change.mutable_state()->set_scene_rev(scene_.scene_rev);
    change.mutable_state()->set_picture_error(failure);
    tell(std::move(change), 0);
}

bool RenderSession::take_frame(bool wait) {
    const std::int64_t began_ns = monotonic_ns();
    auto frame = renderer_->finish_frame(wait);
    const std::int64_t readback_ns = monotonic_ns() - began_ns;
    if (!frame) return false;
    if (renderer_.lost()) return true;
    v1::FrameReport& report = frame->report;
    const auto& passes = report.passes();
    const bool heavy = std::any_of(passes.begin(), passes.end(), [](const v1::PassReport& row) {
        return row.state() == "ran" && (row.name().ends_with("gather") || row.name().ends_with("direct"));
    });
    budget_.took(report.frame_ms(), heavy, frame->rendered_ns);
    if (refinable() || (watched_ && budget_.chosen() != 0)) report.set_settled(false);
    note_picture(failure_of(report));
    if (frame->nv12) {
        ++frames_rendered_;
        out_.picture({report.scene_rev(), frame->width_px, frame->height_px, frame->nv12, frame->drained_ns,
                      frame->rendered_ns, readback_ns});
    }
    for (const Work& query : reports_.take_answered(report.scene_rev()))
        replies_.answer(query, message_of(&v1::ServerMessage::mutable_report, report));
    reports_.keep(std::move(report));
    return true;
}

}  // namespace gonio
