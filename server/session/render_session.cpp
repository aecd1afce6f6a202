#include "server/session/render_session.h"

#include <algorithm>
#include <set>
#include <utility>

#include <spdlog/spdlog.h>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/cue.pb.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/grid.pb.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/show.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/scene/apply_show.h"
#include "server/scene/console.h"
#include "server/scene/light_tables.h"
#include "server/scene/named_lights.h"
#include "server/scene/scene.h"
#include "server/scene/state.h"
#include "server/scene/target_table.h"
#include "server/session/command_files.h"
#include "server/session/file_place.h"
#include "server/session/glare.h"
#include "server/session/grid_values.h"
#include "server/session/isolux.h"
#include "server/session/left_profiles.h"
#include "server/session/mounts.h"
#include "server/session/outlets.h"
#include "server/session/shows.h"
#include "server/show/held_files.h"
#include "server/trace/exposure.h"

namespace gonio {
RenderSession::RenderSession(std::unique_ptr<LiveRenderer> renderer, Scene scene, std::string renderer_name,
                             Queue<Work>& queue, Loader& loader, SessionOutputs outputs)
    : out_(std::move(outputs)),
      renderer_(std::move(renderer), out_.gpu_lost),
      scene_(std::move(scene)),
      renderer_name_(std::move(renderer_name)),
      queue_(queue),
      loader_(loader),
      replies_(out_.reply, scene_),
      changes_(scene_.scene_rev),
      captures_(loader, out_.reply),
      followers_(out_.blobs),
      reference_({out_.reply, [&queue] { queue.wake(Queue<Work>::Wake::soon); },
                  [this](const ReferenceJob& job, std::uint32_t samples) { capture_instead(job, samples); }}),
      scene_files_(out_.reply),
      auto_exposure_(
          scene_, loader, [&queue] { queue.wake(Queue<Work>::Wake::soon); }, trace::metered_ev100),
      auto_range_(
          loader, [&queue] { queue.wake(Queue<Work>::Wake::soon); }, trace::metered_range) {
    begin_renderer();
    prepare_presets();
    told_hidden_ = hidden_.warnings(scene_);
    for (const std::string& warning : told_hidden_) spdlog::warn("{}: {}", scene_.asset->name, warning);
}

void RenderSession::begin_renderer() {
    renderer_->set_refinement(true);
    renderer_->set_watched(watched_);
}

// Presets and cues that come from a saved show bring profiles that no light had yet: the first recall must not wait for
// them.
void RenderSession::prepare_presets() {
    std::set<std::shared_ptr<const Profile>> profiles;
    const auto add = [&](const Preset& preset) {
        for (const PresetLight& light : preset)
            if (profiles.size() < kMaxPrepared) profiles.insert(light.profile);
    };
    for (const auto& [name, preset] : scene_.presets) add(*preset);
    if (scene_.cues)
        for (const auto& cue : *scene_.cues) add(*cue->content);
    if (profiles.empty()) return;
    loader_.submit([profiles = std::move(profiles)] {
        try {
            for (const auto& profile : profiles) tables_of(*profile);
        } catch (const std::bad_alloc&) {  // then whoever needs one tries again
        }
    });
}

void RenderSession::set_renderer(std::unique_ptr<LiveRenderer> renderer) {
    renderer_ = std::move(renderer);
    begin_renderer();
    ++gpu_resets_;
    rendered_rev_ = 0;
    better_ = refined_ = false;
    captures_.restart(renderer_);
}

v1::State RenderSession::state() const {
    v1::State state = full_state(scene_);
    for (const std::string& warning : told_hidden_) state.add_scene_warnings(warning);
    *state.mutable_control() = roles_.control();
    state.set_boot(boot_);
    state.set_restored_rev(restored_rev_);
    state.set_picture_error(picture_error_);
    *state.mutable_show() = show_now();
    *state.mutable_cue_playback() = cue_playback();
    if (follows()) state.set_leader(leader_);
    return state;
}

v1::ShowFile RenderSession::show_now() const {
    v1::ShowFile show = show_file(scene_);
    show.set_can_save(!scene_access_.show_folder.empty());
    show.set_not_held(!why_not_held(*scene_.asset).empty());
    return show;
}

void RenderSession::take(Work work) {
    using Message = v1::ServerMessage;
    static const Error unknown{"unsupported", "message", "", "this server does not know the message"};
    if (work.closed) return forget_session(work.session);
    if (work.leader) return take_leader(work.leader);
    // Positions count in the scene that they are applied to: it may be another one when files have been read. The
    // commands of consoles, session 0, have its positions.
    const bool waits = work.message.has_command() && needs_files(work.message.command());
    if (work.read == waits && work.session != 0) add_place(work.message, -scene_.asset->place);
    switch (work.message.message_case()) {
        case v1::ClientMessage::kIdentify:
            roles_.identify(work.session, work.message.identify());
            undo_.identify(work.session, work.message.identify().undo_key(), work.message.identify().state());
            return tell_undo();
        case v1::ClientMessage::kAcquireControl:
        case v1::ClientMessage::kReleaseControl:
            return change_holder(work);
        case v1::ClientMessage::kCommand:
            return take_command(std::move(work));
        case v1::ClientMessage::kGetState: {
            v1::State now = state();
            if (work.message.get_state().hash()) now.set_hash(show_hash(scene_, hashed_texts_));
            return replies_.answer(work, message_of(&Message::mutable_state, std::move(now)));
        }
        case v1::ClientMessage::kFollow:
            return take_follow(work);
        case v1::ClientMessage::kMeter:
            return renderer_ ? answer_meter(work) : replies_.refuse(work, kGpuLost);
        case v1::ClientMessage::kGrid:
            return renderer_ ? measure(work, check_grid(scene_, work.message.grid())) : replies_.refuse(work, kGpuLost);
        case v1::ClientMessage::kUgr:
            return renderer_ ? measure(work, check_ugr(scene_, work.message.ugr())) : replies_.refuse(work, kGpuLost);
        case v1::ClientMessage::kLuxReport:
            return answer_lux_report(work);
        case v1::ClientMessage::kTargets: {
            v1::Targets targets;
            for (const TargetRow& row : target_table()) put_target(row, *targets.add_targets());
            return replies_.answer(work, message_of(&Message::mutable_targets, std::move(targets)));
        }
        case v1::ClientMessage::kPick:
            return renderer_ ? answer_pick(work) : replies_.refuse(work, kGpuLost);
        case v1::ClientMessage::kBeam:
            return answer_beam(work);
        case v1::ClientMessage::kLibrary:
            return answer_library(work);
        case v1::ClientMessage::kCapture:
            return renderer_ || is_scene_format(work.message.capture().format()) ? answer_capture(work)
                                                                                 : replies_.refuse(work, kGpuLost);
        case v1::ClientMessage::kCancel:
            return cancel(work);
        case v1::ClientMessage::kIsolux:
            return renderer_ ? answer_isolux(work, scene_, picture_error_.empty() ? rendered_rev_ : 0, renderer_,
                                             loader_, replies_)
                             : replies_.refuse(work, kGpuLost);
        case v1::ClientMessage::kReport:
            return answer_report(work);
        case v1::ClientMessage::kStats:
            return replies_.answer(work, message_of(&Message::mutable_stats, stats()));
        case v1::ClientMessage::kProfile:
            return answer_profile(work);
        case v1::ClientMessage::kSources:
            return replies_.answer(work, message_of(&Message::mutable_sources, out_.sources()));
        case v1::ClientMessage::kPatch:
            return replies_.answer(work, message_of(&Message::mutable_patch, patch_in_force(scene_)));
        case v1::ClientMessage::kSurfaces:
            return replies_.answer(work, message_of(&Message::mutable_surfaces, out_.surfaces()));
        case v1::ClientMessage::kLearn:
            return answer_learn(work);
        case v1::ClientMessage::kSaveShow:
            return take_save(std::move(work));
        case v1::ClientMessage::kRenameShow:
        case v1::ClientMessage::kRemoveShow:
            return take_show_edit(std::move(work));
        case v1::ClientMessage::kShows:
            return answer_shows(work, scene_, scene_access_, loader_, replies_);
        case v1::ClientMessage::kGels:
            return replies_.answer(work, message_of(&Message::mutable_gels, gels_reply(scene_.gels.get())));
        default:
            return replies_.refuse(work, unknown);
    }
}

void RenderSession::change_holder(const Work& work) {
    const bool acquires = work.message.has_acquire_control();
    const std::uint32_t before = roles_.holder();
    auto refused = roles_.refuses_change(work.session, acquires ? "acquire_control" : "release_control");
    if (!refused)
        refused = acquires ? roles_.acquire(work.session, work.message.acquire_control().take(), monotonic_ns())
                           : roles_.release(work.session);
    refused ? replies_.refuse(work, *refused) : replies_.ok(work);
    if (roles_.holder() != before) tell_control(work.session);
}

void RenderSession::take_command(Work work) {
    // Asked when the command came: whoever has gone since may have been allowed to.
    if (const auto refused = roles_.refuses_change(work.session, "command"); refused && !work.read)
        return replies_.refuse(work, *refused);
    if (!work.read && needs_files(work.message.command())) return (void)send_to_loader(std::move(work));
    if (work.failure) return replies_.refuse(work, *work.failure);
    if (const auto refused = spell_out_lights(scene_, *work.message.mutable_command()))
        return replies_.refuse(work, *refused);
    if (const auto refused = carry_out_mounts(scene_, *work.message.mutable_command(), work.loaded))
        return replies_.refuse(work, *refused);
    const v1::Command& command = work.message.command();
    command.has_undo() || command.has_redo() ? undo_or_redo(work)
    : plays_cues(command)                    ? run_cue(work)
                                             : apply_command(work);
    tell_undo();
}

// Onto the queue from the loader's thread. It may be full for a moment; what was read or written is worth waiting for.
static void push(Queue<Work>& queue, const Work& work) {
    while (!queue.closed() && !queue.push(work)) std::this_thread::sleep_for(std::chrono::milliseconds(5));
}

// A first time to be written by the loader, a second time when that is done.
void RenderSession::take_save(Work work) {
    std::optional<Error> refused;
    if (work.read)
        refused = work.failure;
    else if (!(refused = roles_.refuses_change(work.session, "save_show")))
        refused = check_save(*work.message.mutable_save_show(), scene_, scene_access_);
    if (refused) return replies_.refuse(work, *refused);
    if (!work.read) {
        if (!save_show(work, scene_, scene_access_, loader_,
                       [&queue = queue_](const Work& done) { push(queue, done); }))
            replies_.busy(work, "too many files are waiting to be read");
        return;
    }
    undo_.note_saved(work.message.save_show().name());
    // Undo may have brought another scene back meanwhile; that one is not in the file.
    if (scene_.geometry_rev <= work.rev) show_saved(scene_, work.message.save_show().name(), work.rev);
    replies_.ok(work, work.loaded.warnings);
    tell_show(work.session);
}

// The name of the show, and whether its file holds it, have changed.
void RenderSession::tell_show(std::uint32_t by) {
    v1::StateChanged change;
    change.set_scene_rev(scene_.scene_rev);
    change.mutable_state()->set_scene_rev(scene_.scene_rev);
    tell(std::move(change), by);
}

// A first time to be done by the loader, a second time when it is.
void RenderSession::take_show_edit(Work work) {
    const bool renames = work.message.has_rename_show();
    std::optional<Error> refused;
    if (work.read)
        refused = work.failure;
    else if (!(refused = roles_.refuses_change(work.session, renames ? "rename_show" : "remove_show")))
        refused = check_show_edit(work.message, scene_access_);
    if (refused) return replies_.refuse(work, *refused);
    if (!work.read) {
        if (!edit_shows(work, scene_access_, loader_, [&queue = queue_](const Work& done) { push(queue, done); }))
            replies_.busy(work, "too many files are waiting to be read");
        return;
    }
    const std::string& name = renames ? work.message.rename_show().name() : work.message.remove_show().name();
    undo_.note_saved(name);
    replies_.ok(work);
    if (scene_.show_name != name) return;
    scene_.show_name = renames ? work.message.rename_show().new_name() : "";
    if (!renames) scene_.show_rev = 0;
    tell_show(work.session);
}

bool RenderSession::send_to_loader(Work work) {
    auto shared = std::make_shared<Work>(std::move(work));
    const bool accepted = loader_.submit([shared, &queue = queue_, access = scene_access_, library = library_] {
        shared->read = true;
        try {
            Result<Loaded> loaded = read_files(shared->message.command(), access, library.get());
            if (loaded)
                shared->loaded = std::move(*loaded);
            else
                shared->failure = loaded.error();
        } catch (const std::exception& exception) {
            shared->failure =
                Error{"too_large", "command", "", std::string("the file cannot be held: ") + exception.what()};
        }
        push(queue, *shared);
    });
    if (!accepted) replies_.busy(*shared, "too many files are waiting to be read");
    return accepted;
}

void RenderSession::tell_control(std::uint32_t by) {
    v1::StateChanged change;
    change.set_scene_rev(scene_.scene_rev);
    change.mutable_state()->set_scene_rev(scene_.scene_rev);
    *change.mutable_state()->mutable_control() = roles_.control();
    tell(std::move(change), by);
}

void RenderSession::tell(v1::StateChanged change, std::uint32_t by) {
    change.set_by(by);
    put_scene_warnings(change);
    const v1::ShowFile show = show_now();
    if (show.name() != told_show_.name() || show.unsaved() != told_show_.unsaved() ||
        show.not_held() != told_show_.not_held()) {
        *change.mutable_state()->mutable_show() = show;
        told_show_ = show;
    }
    if (!follows())
        if (auto playback = cues_.take_news(scene_, monotonic_ns()))
            *change.mutable_state()->mutable_cue_playback() = std::move(*playback);
    if (change.state().has_cue_playback()) ++cues_told_;
    out_.state(state(), std::move(change));
    followers_.tell(shown(), replies_);
}

// The warnings of the scene come with its name: a change that has the name has all of them, maybe none.
void RenderSession::put_scene_warnings(v1::StateChanged& change) {
    auto hidden = hidden_.warnings(scene_);
    if (hidden == told_hidden_ && !change.state().has_scene()) return;
    told_hidden_ = std::move(hidden);
    v1::State& state = *change.mutable_state();
    state.set_scene_rev(scene_.scene_rev);
    state.set_scene(scene_.asset->name);
    state.clear_scene_warnings();
    for (const std::string& warning : scene_.asset->warnings) state.add_scene_warnings(warning);
    for (const std::string& warning : told_hidden_) state.add_scene_warnings(warning);
}

void RenderSession::apply_command(const Work& work) {
    const v1::Command& command = work.message.command();
    std::optional<Error> refused;
    if (command.has_base_rev()) refused = changes_.conflict(scene_, command, command.base_rev(), work.session);
    if (!refused && command.has_set_camera()) refused = roles_.refuses_camera(work.session, monotonic_ns());
    if (!refused && command.has_recall_view())
        refused = roles_.refuses_camera(work.session, monotonic_ns(), "recall_view");
    if (refused) return replies_.refuse(work, *refused);
    const Scene before = scene_;
    Result<Applied> applied = apply(scene_, command, work.loaded);
    if (replaces_scene(command)) list_profiles();
    forget_left_profiles(before, scene_, {work.loaded.profile});
    if (!applied) return replies_.refuse(work, applied.error());
    changes_.note(scene_, before.scene_rev, command, work.session);
    std::ranges::move(outlet_warnings(scene_, &before, &hidden_), std::back_inserter(applied->warnings));
    if (command.has_load_scene() && replaces_scene(command))
        for (const std::string& warning : applied->warnings) spdlog::warn("{}: {}", scene_.asset->name, warning);
    const bool noted = command.has_load_scene() && work.loaded.asset != nullptr;
    replies_.ok(work, std::move(applied->warnings), replaces_scene(command) ? words_of(before) : "",
                noted ? work.loaded.asset->notes : std::vector<std::string>());
    begin_fade(command, work.session, undo_.note(work.session, before, scene_, command));
    if (command.has_open_show()) begin_scene();
    if (command.has_set_exposure() && command.set_exposure().automatic()) auto_exposure_.ask();
    tell_change(before, work.session);
}

// The library has the profiles of the scene that is shown: the loader listed those of a file, of which a refusal left
// nothing, and beside which lights may have been kept.
void RenderSession::list_profiles() {
    loader_.submit([library = library_, profiles = profiles_of(scene_)] { library->keep_scene(profiles); });
}

// A whole scene took the place of the one before, with presets and cues of its own.
void RenderSession::begin_scene() {
    fade_ = Fade();
    cues_.forget();
    prepare_presets();
}

// The first picture of a scene that comes back is not to wait for the tables of its profiles. Result: whether the
// loader makes them; then it brings the work back.
bool RenderSession::make_tables(std::shared_ptr<const Scene> scene, const Work& work) {
    auto shared = std::make_shared<Work>(work);
    shared->read = true;
    shared->prepared = std::move(scene);
    return loader_.submit([shared, &queue = queue_] {
        try {
            for (const Light& light : shared->prepared->lights) tables_of(*light.profile);
        } catch (const std::bad_alloc&) {  // then whoever needs one tries again
        }
        push(queue, *shared);
    });
}

// A change of this client like any other, but no step of its own.
void RenderSession::undo_or_redo(const Work& work) {
    const v1::Command& command = work.message.command();
    const auto refuse = [&](const Error& error) {
        if (work.prepared) forget_left_profiles(scene_, scene_, profiles_of(*work.prepared));
        replies_.refuse(work, error);
    };
    if (command.has_base_rev())
        if (const auto refused = changes_.conflict(scene_, command, command.base_rev(), work.session))
            return refuse(*refused);
    auto plan = undo_.plan(work.session, command.has_redo(), scene_);
    if (!plan) return refuse(plan.error());
    if (work.prepared && plan->scene != work.prepared)  // what came meanwhile must not be undone in its place
        return refuse({"conflict", command.has_redo() ? "redo" : "undo", "", "the scene was changed meanwhile"});
    if (plan->scene && command.has_base_rev()) {  // it replaces everything, as a load does
        v1::Command load;
        load.mutable_load_scene();
        if (const auto refused = changes_.conflict(scene_, load, command.base_rev(), work.session))
            return refuse(*refused);
    }
    if (plan->scene && !work.prepared && make_tables(plan->scene, work)) return;
    Loaded loaded;
    loaded.opened = plan->scene;
    loaded.targets = std::make_shared<const std::vector<EditTarget>>(plan->targets);
    const Scene before = scene_;
    const Result<Applied> applied = apply(scene_, command, loaded);
    if (!applied) return refuse(applied.error());
    forget_left_profiles(before, scene_);
    if (plan->step == fade_step_) fade_ = Fade();
    for (const Edit& edit : undo_.carried_out(work.session, command.has_redo(), *plan, before, scene_))
        if (const std::string path = path_of(scene_, edit.key); !path.empty())
            changes_.note(path, scene_.scene_rev, work.session);
    if (plan->scene) {
        changes_.note_replaced(scene_.scene_rev, work.session);
        begin_scene();
        list_profiles();
    }
    outlet_warnings(scene_, &before, &hidden_);  // told with the state: undo itself is not warned of
    std::vector<std::string> warnings = std::move(plan->warnings);
    warnings.insert(warnings.end(), applied->warnings.begin(), applied->warnings.end());
    replies_.ok(work, std::move(warnings));
    tell_change(before, work.session);
}

void RenderSession::tell_change(const Scene& before, std::uint32_t by) {
    if (scene_.scene_rev == before.scene_rev) return;
    v1::StateChanged change = state_change(before, scene_);
    for (const v1::RenamedLight& light : change.renamed_lights()) fade_.follow(light.name(), light.new_name());
    tell(std::move(change), by);
}

void RenderSession::tell_undo() {
    for (auto& [session, labels] : undo_.take_news())
        out_.reply(session, message_of(&v1::ServerMessage::mutable_undo_state, std::move(labels)));
}

void RenderSession::continue_work() {
    if (roles_.expire(monotonic_ns())) tell_control(0);
    while (const auto work = captures_.take_due(scene_.scene_rev)) answer_capture(*work);
    captures_.refuse_overdue(replies_);
    await_assets();
    const bool meters_go_on = meters_.advance(scene_, renderer_, replies_),
               captures_go_on = captures_.advance(renderer_, replies_);
    wait_for_light_ = !meters_go_on && !captures_go_on;
    reference_.tick();
    if (follows()) return;
    auto_exposure_.tend(scene_, monotonic_ns());
    tend_range();
}

// Nobody's change, as of the exposure.
void RenderSession::tend_range() {
    const auto high = auto_range_.tend(scene_, monotonic_ns());
    if (!high) return;
    const Revision before = scene_.scene_rev;
    v1::Command command;
    command.mutable_set_view()->set_range_high(*high);
    command.mutable_set_view()->set_range_auto(true);
    if (apply(scene_, command, {})) tell_inputs(before);
}

void RenderSession::await_assets() {
    if (renderer_) renderer_->set_awaited({meters_.next_asset(), captures_.next_asset()});
}

void RenderSession::forget_session(std::uint32_t session) {
    captures_.forget_session(session);
    meters_.forget_session(session);
    reports_.forget_session(session);
    followers_.forget_session(session);
    reference_.forget_session(session);
    undo_.forget_session(session);
    out_.gone(session);
    if (roles_.forget(session)) tell_control(session);
}

}  // namespace gonio
