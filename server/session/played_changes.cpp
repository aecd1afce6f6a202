// What changes the show without a command at hand: cues and their timecode, fades, inputs such as faders and consoles,
// the automatic exposure.
#include <algorithm>
#include <utility>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/cue.pb.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/base/clock.h"
#include "server/scene/apply.h"
#include "server/scene/cue_player.h"
#include "server/scene/scene.h"
#include "server/scene/state.h"
#include "server/scene/strobe.h"
#include "server/session/command_files.h"
#include "server/session/render_session.h"

namespace gonio {

void RenderSession::run_cue(const Work& work) {
    const v1::Command& command = work.message.command();
    if (command.has_base_rev())
        if (const auto refused = changes_.conflict(scene_, command, command.base_rev(), work.session))
            return replies_.refuse(work, *refused);
    const Revision before = scene_.scene_rev;
    if (const auto refused = cues_.run(scene_, command, monotonic_ns())) return replies_.refuse(work, *refused);
    fade_ = Fade();
    cue_by_ = work.session;
    replies_.ok(work);
    note_cues(before, work.session);
}

// What cues have changed since that revision: it is no step of undo.
void RenderSession::note_cues(Revision before, std::uint32_t by) {
    static const v1::Command active = [] {
        v1::Command command;
        command.mutable_cue_assert();
        return command;
    }();
    if (scene_.scene_rev != before) {
        changes_.note(scene_, before, active, by);
        undo_.note_inputs(scene_, before, 0);
        tell(state_change(before, scene_), by);
    } else if (const auto news = cues_.take_news(scene_, monotonic_ns())) {
        v1::StateChanged change;
        change.set_scene_rev(scene_.scene_rev);
        change.mutable_state()->set_scene_rev(scene_.scene_rev);
        *change.mutable_state()->mutable_cue_playback() = *news;
        tell(std::move(change), by);
    }
}

void RenderSession::hear_timecode(TimecodeSource source, const Timecode& timecode, std::int64_t t_ns) {
    if (follows()) return;
    const Revision before = scene_.scene_rev;
    cues_.hear(scene_, source, timecode, t_ns, monotonic_ns());
    if (scene_.scene_rev == before) return;
    fade_ = Fade();
    note_cues(before, cue_by_ = 0);
}

// Where the command is a recall that was applied; one without a fade ends the fade that runs.
void RenderSession::begin_fade(const v1::Command& command, std::uint32_t by, std::uint64_t step) {
    if (!command.has_recall_preset()) return;
    const v1::RecallPreset& recall = command.recall_preset();
    fade_by_ = by;
    fade_step_ = step;
    fade_ = Fade();
    cues_.let_go();
    if (recall.fade_s() > 0) fade_ = Fade(scene_, *scene_.presets.at(recall.name()), recall.fade_s(), monotonic_ns());
}

std::vector<std::optional<Error>> RenderSession::apply_inputs(std::span<const v1::Command> commands, std::uint32_t by,
                                                              Driven driven) {
    if (const auto refused = follows() ? roles_.refuses_change(by, "command") : std::nullopt)
        return std::vector(commands.size(), refused);
    const Revision before = scene_.scene_rev;
    std::vector<v1::Command> plain;  // where some are carried out otherwise: the others
    const bool held = roles_.holder() != 0;
    if (held || std::ranges::any_of(commands, plays_cues)) {
        plain.assign(commands.begin(), commands.end());
        for (v1::Command& command : plain)
            if ((held && command.has_set_camera()) || plays_cues(command)) command.Clear();
    }
    std::vector<std::optional<Error>> refused =
        gonio::apply_inputs(scene_, plain.empty() ? commands : std::span<const v1::Command>(plain), driven);
    for (std::size_t i = 0; i < commands.size(); ++i) {
        if (commands[i].has_set_camera() && held) refused[i] = roles_.refuses_camera(by, monotonic_ns());
        if (plays_cues(commands[i])) {
            refused[i] = cues_.run(scene_, commands[i], monotonic_ns());
            if (!refused[i]) fade_ = Fade();
            cue_by_ = by;
        }
        changes_.note(scene_, before, commands[i], by);
        if (refused[i]) replies_.count_refused();
        if (needs_files(commands[i])) {
            Work work;
            *work.message.mutable_command() = commands[i];
            if (!send_to_loader(std::move(work)))
                refused[i] = Error{"busy", "", "", "too many files are waiting to be read"};
        }
        if (!refused[i]) begin_fade(commands[i], by, 0);
    }
    undo_.note_inputs(scene_, before, by == 0 ? 0 : fade_step_);
    return refused;
}

void RenderSession::advance_fade(std::int64_t now_ns) {
    if (fade_.running()) {
        const Revision before = scene_.scene_rev;
        apply_inputs(fade_.step(scene_, now_ns), fade_by_);
        tell_inputs(before, fade_by_);
    }
    if (set_flashes(scene_, static_cast<double>(now_ns) * 1e-9)) flashed_ = true;
    if (follows()) return;
    const Revision before_cues = scene_.scene_rev;
    cues_.advance(scene_, now_ns);
    note_cues(before_cues, cue_by_);
    auto ev100 = auto_exposure_.first_light(scene_, now_ns);
    if (!ev100) ev100 = auto_exposure_.step(now_ns);
    if (!ev100) return;
    // Nobody's change: it is in no client's way (base_rev).
    const Revision faded = scene_.scene_rev;
    v1::Command command;
    command.mutable_set_exposure()->set_ev100(*ev100);
    command.mutable_set_exposure()->set_automatic(true);
    gonio::apply_inputs(scene_, std::span(&command, 1));
    tell_inputs(faded);
}

void RenderSession::tell_inputs(Revision before, std::uint32_t by) {
    if (scene_.scene_rev != before) tell(state_change(before, scene_), by);
}

}  // namespace gonio
