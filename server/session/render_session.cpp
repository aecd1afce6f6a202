#include "server/session/render_session.h"

#include <algorithm>
#include <set>
#include <utility>

#include "protocol/schema/codec.h"
#include "server/render/quality_level.h"
#include "server/scene/console.h"
#include "server/scene/light_tables.h"
#include "server/scene/state.h"
#include "server/session/capture_file.h"
#include "server/session/command_files.h"
#include "server/session/meter_reply.h"

namespace gonio {
namespace {

// A slice of meters: live frames wait no longer than this and one point.
constexpr std::int64_t kSliceNs = 8'000'000;

}  // namespace

RenderSession::RenderSession(std::unique_ptr<LiveRenderer> renderer, Scene scene, std::string renderer_name,
                             Queue<Work>& queue, Loader& loader, SessionOutputs outputs)
    : renderer_(std::move(renderer)),
      scene_(std::move(scene)),
      renderer_name_(std::move(renderer_name)),
      queue_(queue),
      loader_(loader),
      out_(std::move(outputs)),
      changes_(scene_.scene_rev),
      reference_({out_.reply, [&queue] { queue.wake(Queue<Work>::Wake::soon); }}) {
    renderer_->set_refinement(true);
    renderer_->set_watched(watched_);
    prepare_presets();
}

// Presets that come from a saved show bring profiles that no light had yet: the first recall must not wait for them.
void RenderSession::prepare_presets() {
    std::set<std::shared_ptr<const Profile>> profiles;
    for (const auto& [name, preset] : scene_.presets)
        for (const PresetLight& light : *preset)
            if (profiles.size() < kMaxPrepared) profiles.insert(light.profile);
    if (profiles.empty()) return;
    loader_.submit([profiles = std::move(profiles)] {
        try {
            for (const auto& profile : profiles) tables_of(*profile);
        } catch (const std::bad_alloc&) {  // then whoever needs one tries again
        }
    });
}

void RenderSession::answer(const Work& work, v1::ServerMessage message) {
    if (work.message.request_id() == 0) return;
    message.set_request_id(work.message.request_id());
    out_.reply(work.session, std::move(message));
}

void RenderSession::refuse(const Work& work, const Error& error) {
    ++refused_;
    v1::ServerMessage message;
    *message.mutable_result() = refusal(error);
    message.mutable_result()->set_scene_rev(scene_.scene_rev);
    answer(work, std::move(message));
}

// Runs what needs the GPU. Result: whether it was there; what was made is void where it was lost meanwhile.
template <typename Draw>
bool RenderSession::draws(const Draw& draw) {
    try {
        draw();
    } catch (const std::exception&) {  // a program that did not link, say
        if (!out_.gpu_lost()) throw;
        return false;
    }
    return !out_.gpu_lost();
}

void RenderSession::set_renderer(std::unique_ptr<LiveRenderer> renderer) {
    renderer_ = std::move(renderer);
    renderer_->set_refinement(true);
    renderer_->set_watched(watched_);
    ++gpu_resets_;
    rendered_rev_ = 0;
    better_ = refined_ = false;
    for (Capturing& capturing : captures_waiting_) {
        const CaptureJob& job = *capturing.job;
        const int bounces = job.bounces;
        capturing.job =
            renderer_->begin_capture(job.scene, job.view, job.picture->width_px, job.picture->height_px, job.raw);
        capturing.job->bounces = bounces;
    }
}

v1::State RenderSession::state() const {
    v1::State state = full_state(scene_);
    *state.mutable_control() = roles_.control();
    return state;
}

void RenderSession::take(Work work) {
    if (work.closed) return forget_session(work.session);
    switch (work.message.message_case()) {
        case v1::ClientMessage::kIdentify:
            return roles_.identify(work.session, work.message.identify());
        case v1::ClientMessage::kAcquireControl: {
            const std::uint32_t before = roles_.holder();
            auto refused = roles_.refuses_change(work.session, "acquire_control");
            if (!refused) refused = roles_.acquire(work.session, work.message.acquire_control().take(), monotonic_ns());
            return answer_control(work, refused, before);
        }
        case v1::ClientMessage::kReleaseControl: {
            const std::uint32_t before = roles_.holder();
            auto refused = roles_.refuses_change(work.session, "release_control");
            if (!refused) refused = roles_.release(work.session);
            return answer_control(work, refused, before);
        }
        case v1::ClientMessage::kCommand:
            // Asked when the command came: whoever has gone since may have been allowed to.
            if (const auto refused = roles_.refuses_change(work.session, "command"); refused && !work.read)
                return refuse(work, *refused);
            if (!work.read && needs_files(work.message.command())) return (void)send_to_loader(std::move(work));
            if (work.failure) return refuse(work, *work.failure);
            return apply_command(work);
        case v1::ClientMessage::kGetState: {
            v1::ServerMessage message;
            *message.mutable_state() = state();
            return answer(work, std::move(message));
        }
        case v1::ClientMessage::kMeter:
        case v1::ClientMessage::kCapture:
            if (!renderer_) return refuse(work, {"unavailable", "", "", "the GPU was lost"});
            return work.message.has_meter() ? answer_meter(work) : answer_capture(work);
        case v1::ClientMessage::kReport:
            return answer_report(work);
        case v1::ClientMessage::kStats:
            return answer_stats(work);
        case v1::ClientMessage::kProfile:
            return answer_profile(work);
        case v1::ClientMessage::kSources: {
            v1::ServerMessage message;
            *message.mutable_sources() = out_.sources();
            return answer(work, std::move(message));
        }
        case v1::ClientMessage::kPatch: {
            v1::ServerMessage message;
            *message.mutable_patch() = patch_in_force(scene_);
            return answer(work, std::move(message));
        }
        case v1::ClientMessage::kSurfaces: {
            v1::ServerMessage message;
            *message.mutable_surfaces() = out_.surfaces();
            return answer(work, std::move(message));
        }
        case v1::ClientMessage::kLearn: {
            if (const auto refused = roles_.refuses_change(work.session, "learn")) return refuse(work, *refused);
            const double timeout_s = work.message.learn().timeout_s();
            if (timeout_s != 0 && !(timeout_s >= 0.1 && timeout_s <= 600))
                return refuse(work, {"invalid_argument", "learn.timeout_s", print_number(timeout_s),
                                     "must be a number from 0.1 to 600"});
            return out_.learn(work.session, work.message.request_id(), timeout_s == 0 ? 30 : timeout_s);
        }
        default:
            return refuse(work, {"unsupported", "message", "", "this server does not know the message"});
    }
}

bool RenderSession::send_to_loader(Work work) {
    auto shared = std::make_shared<Work>(std::move(work));
    const bool accepted = loader_.submit([shared, &queue = queue_, access = scene_access_] {
        shared->read = true;
        try {
            Result<Loaded> loaded = read_files(shared->message.command(), access);
            if (loaded)
                shared->loaded = std::move(*loaded);
            else
                shared->failure = loaded.error();
        } catch (const std::exception& exception) {
            shared->failure =
                Error{"too_large", "command", "", std::string("the file cannot be held: ") + exception.what()};
        }
        // The queue may be full for a moment; the result of a finished read is worth waiting for.
        while (!queue.closed() && !queue.push(*shared)) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    });
    if (!accepted) refuse(*shared, {"busy", "", "", "too many files are waiting to be read"});
    return accepted;
}

std::optional<Error> RenderSession::refuses(const Work& work) {
    const v1::Command& command = work.message.command();
    if (command.has_base_rev())
        if (auto conflict = changes_.conflict(scene_, command, command.base_rev(), work.session)) return conflict;
    if (command.has_set_camera()) return roles_.refuses_camera(work.session, monotonic_ns());
    return std::nullopt;
}

void RenderSession::answer_control(const Work& work, const std::optional<Error>& refused, std::uint32_t holder_before) {
    if (refused) {
        refuse(work, *refused);
    } else {
        v1::ServerMessage message;
        message.mutable_result()->set_code("ok");
        message.mutable_result()->set_scene_rev(scene_.scene_rev);
        answer(work, std::move(message));
    }
    if (roles_.holder() != holder_before) tell_control(work.session);
}

void RenderSession::tell_control(std::uint32_t by) {
    v1::StateChanged change;
    change.set_scene_rev(scene_.scene_rev);
    change.mutable_state()->set_scene_rev(scene_.scene_rev);
    *change.mutable_state()->mutable_control() = roles_.control();
    change.set_by(by);
    out_.state(state(), std::move(change));
}

void RenderSession::apply_command(const Work& work) {
    if (const auto refused = refuses(work)) return refuse(work, *refused);
    const Scene before = scene_;
    Result<Applied> applied = apply(scene_, work.message.command(), work.loaded);
    if (!applied) return refuse(work, applied.error());
    changes_.note(scene_, before.scene_rev, work.message.command(), work.session);
    v1::ServerMessage message;
    v1::Result& result = *message.mutable_result();
    result.set_code("ok");
    result.set_scene_rev(applied->scene_rev);
    for (std::string& warning : applied->warnings) result.add_warnings(std::move(warning));
    answer(work, std::move(message));
    begin_fade(work.message.command(), work.session);
    if (scene_.scene_rev == before.scene_rev) return;
    v1::StateChanged change = state_change(before, scene_);
    change.set_by(work.session);
    out_.state(state(), std::move(change));
}

std::vector<std::optional<Error>> RenderSession::apply_inputs(std::span<const v1::Command> commands, std::uint32_t by) {
    const Revision before = scene_.scene_rev;
    std::vector<v1::Command> without_camera;
    if (roles_.holder() != 0) {
        without_camera.assign(commands.begin(), commands.end());
        for (v1::Command& command : without_camera)
            if (command.has_set_camera()) command.Clear();
    }
    std::vector<std::optional<Error>> refused =
        gonio::apply_inputs(scene_, without_camera.empty() ? commands : std::span<const v1::Command>(without_camera));
    for (std::size_t i = 0; i < commands.size(); ++i) {
        if (commands[i].has_set_camera() && !without_camera.empty())
            refused[i] = roles_.refuses_camera(by, monotonic_ns());
        changes_.note(scene_, before, commands[i], by);
    }
    refused_ += static_cast<std::uint32_t>(
        std::count_if(refused.begin(), refused.end(), [](const auto& one) { return one.has_value(); }));
    for (std::size_t i = 0; i < commands.size(); ++i) {
        if (!needs_files(commands[i])) continue;
        Work work;
        *work.message.mutable_command() = commands[i];
        if (!send_to_loader(std::move(work)))
            refused[i] = Error{"busy", "", "", "too many files are waiting to be read"};
    }
    for (std::size_t i = 0; i < commands.size(); ++i) {
        if (!refused[i]) begin_fade(commands[i], by);
    }
    return refused;
}

// A recall without a fade ends one that runs.
void RenderSession::begin_fade(const v1::Command& command, std::uint32_t by) {
    if (!command.has_recall_preset()) return;
    fade_by_ = by;
    const v1::RecallPreset& recall = command.recall_preset();
    fade_ =
        recall.fade_s() > 0 ? Fade(scene_, *scene_.presets.at(recall.name()), recall.fade_s(), monotonic_ns()) : Fade();
}

void RenderSession::advance_fade(std::int64_t now_ns) {
    if (!fade_.running()) return;
    const Revision before = scene_.scene_rev;
    apply_inputs(fade_.step(scene_, now_ns), fade_by_);
    tell_inputs(before, fade_by_);
}

void RenderSession::tell_inputs(Revision before, std::uint32_t by) {
    if (scene_.scene_rev == before) return;
    v1::StateChanged change = state_change(before, scene_);
    change.set_by(by);
    out_.state(state(), std::move(change));
}

// Result: nothing where the GPU was lost.
std::optional<v1::MeterReading> RenderSession::read_meter(const Scene& scene, const trace::MeterPoint& point,
                                                          Quality quality, int bounces) {
    std::optional<v1::MeterReading> reading;
    const bool there = draws([&] {
        reading = renderer_->meter(
            scene, point.position, point.normal,
            quality == Quality::rsm ? LiveRenderer::MeterQuality::rsm : LiveRenderer::MeterQuality::interactive,
            bounces);
    });
    return there ? reading : std::nullopt;
}

void RenderSession::answer_meter(const Work& work) {
    auto request = check_meter(work.message.meter());
    if (!request) return refuse(work, request.error());
    if (request->quality == Quality::reference) {
        return submit_reference({work.session, work.message.request_id(), scene_, std::move(*request)}, work);
    }
    if (request->quality == Quality::rsm && scene_.lights.size() > kMostLayers)
        return refuse(work, {"too_many_lights", "meter.quality", "rsm",
                             "reflective shadow maps are made of at most " + std::to_string(kMostLayers) + " lights"});
    if (meters_waiting_.size() >= kMaxMeters) return refuse(work, {"busy", "", "", "too many meters are waiting"});
    meters_waiting_.push_back({work, scene_, std::move(*request), {}});
}

void RenderSession::answer_capture(const Work& work) {
    if (const std::uint32_t rev = work.message.capture().after_rev(); rev > scene_.scene_rev) {
        if (const auto good = check_capture(scene_, work.message.capture()); !good) return refuse(work, good.error());
        if (!late_.add(work, rev, monotonic_ns())) refuse(work, {"busy", "", "", "too many captures are waiting"});
        return;
    }
    auto request = check_capture(scene_, work.message.capture());
    if (!request) return refuse(work, request.error());
    if (request->quality == Quality::reference) {
        return submit_reference({work.session, work.message.request_id(), scene_, std::move(*request)}, work);
    }
    if (captures_waiting_.size() >= most_captures_) {
        return refuse(work, {"busy", "", "", "too many captures are waiting"});
    }
    captures_waiting_.push_back({work, request->format,
                                 renderer_->begin_capture(scene_, request->view, request->width_px, request->height_px,
                                                          request->format == "exr")});
    captures_waiting_.back().job->bounces = request->settings.bounces;
}

void RenderSession::submit_reference(ReferenceJob job, const Work& work) {
    if (!reference_.submit(std::move(job))) refuse(work, {"busy", "", "", "too many reference jobs are waiting"});
}

void RenderSession::continue_work() {
    not_ready_ = false;
    if (roles_.expire(monotonic_ns())) tell_control(0);
    continue_late();
    continue_meter();
    continue_capture();
    reference_.tick();
}

void RenderSession::continue_late() {
    if (late_.empty()) return;
    while (auto work = late_.take_due(scene_.scene_rev)) answer_capture(*work);
    while (const auto work = late_.take_overdue(monotonic_ns()))
        refuse(*work, {"timeout", "capture.after_rev", std::to_string(work->message.capture().after_rev()),
                       "the scene has not reached this revision within 30 s"});
}

bool RenderSession::ready(const Scene& scene) {
    bool there = false;
    draws([&] { there = renderer_->ready(scene); });
    not_ready_ = !there;
    return there;
}

void RenderSession::continue_meter() {
    const std::int64_t started_ns = monotonic_ns();
    if (!meters_waiting_.empty() && !ready(meters_waiting_.front().scene)) return;
    while (!meters_waiting_.empty()) {
        Metering& meter = meters_waiting_.front();
        while (meter.readings.size() < meter.request.points.size()) {
            if (monotonic_ns() - started_ns > kSliceNs) return;
            const trace::MeterPoint& point = meter.request.points[meter.readings.size()];
            auto reading = read_meter(meter.scene, point, meter.request.quality, meter.request.settings.bounces);
            if (!reading) return;  // goes on with the next renderer
            meter.readings.push_back(std::move(*reading));
        }
        answer(meter.work, meter_message(std::move(meter.readings), meter.request.grid));
        meters_waiting_.pop_front();
    }
}

void RenderSession::continue_capture() {
    if (captures_waiting_.empty() || !ready(captures_waiting_.front().job->scene)) return;
    bool complete = false;
    const bool there = draws([&] { complete = renderer_->continue_capture(*captures_waiting_.front().job); });
    if (!there || !complete) return;  // without the GPU it begins anew with the next renderer
    Capturing done = std::move(captures_waiting_.front());
    captures_waiting_.pop_front();
    ++captures_;
    // Compressing takes long too: it is the loader's.
    auto job = std::make_shared<CaptureJob>(std::move(*done.job));
    const bool accepted = loader_.submit([work = done.work, format = done.format, job, reply = out_.reply] {
        const CapturedPicture& picture = *job->picture;
        const Result<std::vector<std::byte>> image = encode_capture(picture, job->view, format);
        v1::ServerMessage message;
        message.set_request_id(work.message.request_id());
        if (image) {
            v1::CaptureResult& result = *message.mutable_capture();
            result.set_format(format);
            result.set_image(std::string(reinterpret_cast<const char*>(image->data()), image->size()));
            result.set_width_px(static_cast<std::uint32_t>(picture.width_px));
            result.set_height_px(static_cast<std::uint32_t>(picture.height_px));
            result.set_scene_rev(job->scene.scene_rev);
            *result.mutable_report() = picture.report;
        } else {
            *message.mutable_result() = refusal(image.error());
        }
        reply(work.session, std::move(message));
    });
    if (!accepted) refuse(done.work, {"busy", "", "", "too many pictures are waiting to be written"});
}

void RenderSession::forget_session(std::uint32_t session) {
    std::erase_if(captures_waiting_, [&](const Capturing& capturing) { return capturing.work.session == session; });
    std::erase_if(meters_waiting_, [&](const Metering& metering) { return metering.work.session == session; });
    std::erase_if(waiting_, [&](const Waiting& waiting) { return waiting.session == session; });
    late_.forget([&](const Work& work) { return work.session == session; });
    reference_.forget_session(session);
    out_.gone(session);
    if (roles_.forget(session)) tell_control(session);
}

void RenderSession::answer_report(const Work& work) {
    const std::uint32_t rev = work.message.report().rev();
    if (rev > scene_.scene_rev) {
        return refuse(work, {"invalid_argument", "report.rev", std::to_string(rev),
                             "the scene is at revision " + std::to_string(scene_.scene_rev)});
    }
    if (waiting_.size() >= kMaxWaiting) return refuse(work, {"busy", "", "", "too many reports are waited for"});
    if (rev > 0) {
        for (const v1::FrameReport& report : reports_) {
            if (report.scene_rev() < rev) continue;
            v1::ServerMessage message;
            *message.mutable_report() = report;
            return answer(work, std::move(message));
        }
    }
    // rev 0 asks for the scene as it stands: one more frame, clean if nothing moved.
    waiting_.push_back({work.session, work.message.request_id(), rev == 0 ? scene_.scene_rev : rev});
}

void RenderSession::answer_profile(const Work& work) {
    const std::string& name = work.message.profile().light();
    for (const Light& light : scene_.lights) {
        if (light.name != name) continue;
        const ies::PhotometricWeb& web = light.profile->photometry.web;
        v1::ServerMessage message;
        v1::ProfileReply& reply = *message.mutable_profile();
        reply.set_light(name);
        reply.set_profile(light.profile->name);
        reply.set_max_cd(light.profile->max_cd);
        reply.set_flux_lm(light.profile->flux_lm);
        for (int v = 0; v <= 180; v += 2) {
            const auto at = [&](double h) {
                return ies::intensity(web,
                                      ies::direction_of(ies::Goniometer::type_c, Angle::degrees(v), Angle::degrees(h)))
                    .in(cd);
            };
            reply.add_v_deg(v);
            reply.add_c0_cd(at(0));
            reply.add_c90_cd(at(90));
            reply.add_c180_cd(at(180));
            reply.add_c270_cd(at(270));
        }
        return answer(work, std::move(message));
    }
    refuse(work, {"not_found", "profile.light", name, "there is no light of this name"});
}

void RenderSession::answer_stats(const Work& work) {
    v1::ServerMessage message;
    v1::Stats& stats = *message.mutable_stats();
    stats = out_.counters();
    *stats.mutable_sources() = out_.sources();
    stats.set_frames_rendered(frames_rendered_);
    stats.set_captures(captures_);
    stats.set_commands_refused(refused_);
    stats.set_scene_rev(scene_.scene_rev);
    stats.set_settled(stats.settled() && settled());
    stats.set_renderer(renderer_name_);
    stats.set_gpu_resets(gpu_resets_);
    if (renderer_) *stats.mutable_transport() = renderer_->transport_stats();
    stats.set_transport_ready(stats.transport().ready());
    reference_.add_counters(stats);
    answer(work, std::move(message));
}

void RenderSession::begin_frame(std::int64_t drained_ns) {
    draws([&] {
        if (renderer_->frames_in_flight() >= kMaxFramesInFlight) take_frame(true);
        // A frame that lights nothing anew keeps the picture's size, and with it what the picture is made of.
        const std::int64_t now_ns = monotonic_ns();
        if (lights_anew() || owes()) renderer_->set_quality_level(budget_.choose(now_ns));
        renderer_->begin_frame(scene_, drained_ns);
        if (rendered_rev_ != scene_.scene_rev) changed_ns_ = now_ns;
        rendered_rev_ = scene_.scene_rev;
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
    draws([&] { better_ = renderer_->refine(scene_, [this] { return queue_.pressing(); }); });
}

void RenderSession::finish_frames(bool wait) {
    draws([&] {
        while (take_frame(wait)) {
        }
    });
}

bool RenderSession::take_frame(bool wait) {
    const std::int64_t began_ns = monotonic_ns();
    auto frame = renderer_->finish_frame(wait);
    if (!frame) return false;
    publish(std::move(*frame), monotonic_ns() - began_ns);
    return true;
}

void RenderSession::publish(FinishedFrame frame, std::int64_t readback_ns) {
    if (out_.gpu_lost()) return;
    const auto& passes = frame.report.passes();
    const bool heavy = std::any_of(passes.begin(), passes.end(), [](const v1::PassReport& row) {
        return row.state() == "ran" && (row.name().ends_with("gather") || row.name().ends_with("direct"));
    });
    budget_.took(frame.report.frame_ms(), heavy, frame.rendered_ns);
    if (refinable() || (watched_ && budget_.chosen() != 0)) frame.report.set_settled(false);
    if (frame.nv12) {
        ++frames_rendered_;
        out_.picture({frame.report.scene_rev(), frame.width_px, frame.height_px, frame.nv12, frame.drained_ns,
                      frame.rendered_ns, readback_ns});
    }
    std::erase_if(waiting_, [&](const Waiting& waiting) {
        if (frame.report.scene_rev() < waiting.rev) return false;
        v1::ServerMessage message;
        message.set_request_id(waiting.request_id);
        *message.mutable_report() = frame.report;
        out_.reply(waiting.session, std::move(message));
        return true;
    });
    // Of several frames of one revision the first is kept: it is the one that shows what the change cost.
    if (reports_.empty() || reports_.back().scene_rev() != frame.report.scene_rev()) {
        reports_.push_back(std::move(frame.report));
    }
    if (reports_.size() > kMaxReports) reports_.pop_front();
}

}  // namespace gonio
