#include "server/scene/cue_player.h"

#include <algorithm>
#include <map>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/cue.pb.h"
#include "server/base/clock.h"
#include "server/scene/apply.h"
#include "server/scene/apply_checks.h"
#include "server/scene/apply_cues.h"
#include "server/scene/edit.h"
#include "server/scene/limits.h"
#include "server/scene/preset.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

v1::Command goto_cue(CueNumber number) {
    v1::Command command;
    command.mutable_cue_goto()->set_number(print_cue_number(number));
    return command;
}

std::optional<double> time_of(const v1::Command& command, const Scene& scene) {
    if (command.has_cue_goto() && command.cue_goto().has_time_s()) return command.cue_goto().time_s();
    if (command.has_cue_assert() && command.cue_assert().has_time_s()) return command.cue_assert().time_s();
    if (command.has_cue_stop()) return scene.cue_options.back_s;
    if (command.has_cue_back())
        return command.cue_back().has_time_s() ? command.cue_back().time_s() : scene.cue_options.back_s;
    return std::nullopt;
}

}  // namespace

bool plays_cues(const v1::Command& command) {
    return command.has_cue_go() || command.has_cue_back() || command.has_cue_stop() || command.has_cue_goto() ||
           command.has_cue_assert();
}

Numbers CuePlayer::Part::at(std::int64_t t_ns) const {
    if (over(t_ns)) return to;
    const double t_s = seconds_between(began_ns, t_ns) - delay_s;
    return t_s <= 0.0 ? from : between(*light_row, from, to, t_s / time_s);
}

bool CuePlayer::Part::over(std::int64_t t_ns) const {
    return seconds_between(began_ns, t_ns) >= delay_s + time_s;
}

std::optional<Error> CuePlayer::run(Scene& scene, const v1::Command& command, std::int64_t now_ns) {
    follow(scene);
    if (command.has_cue_go() && go_ns_ && seconds_between(*go_ns_, now_ns) < scene.cue_options.guard_s)
        return Error{"too_soon", "cue_go", print_number(seconds_between(*go_ns_, now_ns)) + " s",
                     "another GO came less than " + print_number(scene.cue_options.guard_s) + " s before"};
    if (command.has_cue_stop() && !held_ns_) {
        if (running(now_ns)) hold(scene, now_ns);
        go_ns_.reset();
        return std::nullopt;
    }
    if (command.has_cue_go() && held_ns_) {
        go_on(now_ns);
        go_ns_ = now_ns;
        advance(scene, now_ns);
        return std::nullopt;
    }
    try {
        const CueNumber number = cue_meant(scene, command);
        const bool back = command.has_cue_back() || command.has_cue_stop();
        begin(scene, command, number, time_of(command, scene), !back && !command.has_cue_assert(), now_ns);
    } catch (const Refused& refused) {
        return refused.error;
    }
    go_ns_ = command.has_cue_go() ? std::optional(now_ns) : std::nullopt;
    advance(scene, now_ns);
    return std::nullopt;
}

void CuePlayer::start(Scene& scene, CueNumber number, std::int64_t began_ns, std::int64_t now_ns) {
    advance(scene, began_ns);
    if (find_cue(scene, number) != nullptr) begin(scene, goto_cue(number), number, std::nullopt, true, began_ns);
    advance(scene, now_ns);
}

void CuePlayer::jump(Scene& scene, CueNumber before, CueNumber number, std::int64_t began_ns, std::int64_t now_ns) {
    follow(scene);
    next_ns_.reset();
    const Cue* cue = find_cue(scene, number);
    const bool over = cue == nullptr || seconds_between(began_ns, now_ns) >= cue->duration_s();
    if (!over && find_cue(scene, before) != nullptr) {
        begin(scene, goto_cue(before), before, 0.0, false, began_ns);
        write(scene, began_ns);
    }
    start(scene, number, began_ns, now_ns);
}

// goes_on: its follow or hang counts.
void CuePlayer::begin(Scene& scene, const v1::Command& command, CueNumber number, std::optional<double> time_s,
                      bool goes_on, std::int64_t began_ns) {
    const std::shared_ptr<const Cue> cue = cue_of(scene, number);
    if (held_ns_) go_on(began_ns);
    apply(scene, command, {.cue = number});
    const Times times =
        time_s ? Times{*time_s, *time_s, 0.0, 0.0} : Times{cue->up_s, cue->down_s, cue->delay_up_s, cue->delay_down_s};
    take_content(scene, *cue, times, began_ns);
    active_ = number;
    began_ns_ = began_ns;
    ends_ns_ = began_ns + nanoseconds_of(time_s ? *time_s : cue->duration_s());
    next_ns_.reset();
    if (goes_on && cue->follow_s) next_ns_ = began_ns + nanoseconds_of(*cue->follow_s);
    if (goes_on && cue->hang_s) next_ns_ = ends_ns_ + nanoseconds_of(*cue->hang_s);
}

// What has another end now goes there from where it is. What has the same end goes on in its own time, as does what the
// cue does not know.
void CuePlayer::take_content(const Scene& scene, const Cue& cue, const Times& times, std::int64_t began_ns) {
    std::map<std::pair<std::uint32_t, const LightRow*>, Part> parts;
    for (Part& part : parts_) parts.emplace(std::pair(part.light, part.light_row), part);
    std::map<std::string_view, const Light*> lights;
    for (const Light& light : scene.lights) lights.emplace(light.name, &light);
    for (const PresetLight& kept : *cue.content) {
        const auto found = lights.find(kept.name);
        if (found == lights.end()) continue;
        const Light& light = *found->second;
        for (const LightRow& light_row : light_rows()) {
            const std::pair key(light.id, &light_row);
            const Numbers now = numbers_of(light, light_row), to = numbers_of(kept, light_row);
            const auto running = parts.find(key);
            const bool ours = running != parts.end() && running->second.said == now;
            if (ours && running->second.to == to) continue;
            const Numbers from = ours ? running->second.at(began_ns) : now;
            if (running != parts.end()) parts.erase(running);
            if (from == to && now == to) continue;
            const bool falls = light_row.property == Property::level && to[0] < from[0];
            parts.emplace(key, Part{light.id, &light_row, from, to, now, began_ns,
                                    falls ? times.delay_down_s : times.delay_up_s, falls ? times.down_s : times.up_s});
        }
    }
    parts_.clear();
    for (auto& [key, part] : parts) parts_.push_back(part);
}

// Where another scene or show is there, nothing of the last one goes on.
void CuePlayer::follow(const Scene& scene) {
    if (scene.cue_active == active_) return;
    parts_.clear();
    next_ns_.reset();
    held_ns_.reset();
    go_ns_.reset();
    active_ = scene.cue_active;
    began_ns_ = ends_ns_ = 0;
}

void CuePlayer::advance(Scene& scene, std::int64_t now_ns) {
    follow(scene);
    if (held_ns_) return;
    if (next_ns_ && find_cue(scene, active_) == nullptr) next_ns_.reset();
    for (std::size_t cues = 0; cues <= kMaxCues && next_ns_ && *next_ns_ <= now_ns; ++cues) {
        const std::int64_t due_ns = *next_ns_;
        next_ns_.reset();
        const CueNumber next = scene.cue_next;
        if (find_cue(scene, next) == nullptr) break;
        begin(scene, goto_cue(next), next, std::nullopt, true, due_ns);
    }
    write(scene, now_ns);
}

// What another hand has moved, and lights that are gone, leave.
void CuePlayer::write(Scene& scene, std::int64_t now_ns) {
    std::vector<v1::Command> commands;
    std::vector<Part> left;
    std::uint32_t last = 0;
    for (Part& part : parts_) {
        const Light* light = light_of(scene, part.light);
        if (light == nullptr || numbers_of(*light, *part.light_row) != part.said) continue;
        const Numbers now = part.at(now_ns);
        if (now != part.said) {
            if (commands.empty() || last != part.light)
                commands.emplace_back().mutable_set_light()->set_name(light->name);
            last = part.light;
            write_numbers(*commands.back().mutable_set_light(), row_of(part.light_row->property).field, *part.light_row,
                          now);
            part.said = now;
        }
        if (!part.over(now_ns)) left.push_back(part);
    }
    parts_ = std::move(left);
    if (!commands.empty()) apply_inputs(scene, commands, Driven::by_console);
}

void CuePlayer::hold(Scene& scene, std::int64_t now_ns) {
    advance(scene, now_ns);
    held_ns_ = now_ns;
}

void CuePlayer::go_on(std::int64_t now_ns) {
    const std::int64_t held_ns = std::max<std::int64_t>(0, now_ns - *held_ns_);
    held_ns_.reset();
    for (Part& part : parts_) part.began_ns += held_ns;
    began_ns_ += held_ns;
    ends_ns_ += held_ns;
    if (next_ns_) *next_ns_ += held_ns;
}

bool CuePlayer::running(std::int64_t now_ns) const {
    return !parts_.empty() || next_ns_ || now_ns < ends_ns_;
}

v1::CuePlayback CuePlayer::playback(const Scene& scene, std::int64_t now_ns) const {
    v1::CuePlayback playback;
    playback.set_active(print_cue_number(scene.cue_active));
    playback.set_next(print_cue_number(scene.cue_next));
    playback.set_held(held_ns_.has_value());
    playback.set_guard_s(scene.cue_options.guard_s);
    playback.set_back_s(scene.cue_options.back_s);
    playback.set_timecode_source(timecode_source_name(scene.cue_options.timecode));
    playback.set_freewheel_s(scene.cue_options.freewheel_s);
    if (scene.cue_active == 0 || scene.cue_active != active_) return playback;
    const std::int64_t t_ns = held_ns_.value_or(now_ns);
    const double whole_s = seconds_between(began_ns_, ends_ns_);
    playback.set_running(running(t_ns));
    playback.set_remaining_s(std::max(0.0, seconds_between(t_ns, ends_ns_)));
    playback.set_progress_ratio(whole_s > 0 ? std::clamp(seconds_between(began_ns_, t_ns) / whole_s, 0.0, 1.0) : 1.0);
    if (next_ns_ && scene.cue_next != 0) playback.set_next_in_s(std::max(0.0, seconds_between(t_ns, *next_ns_)));
    return playback;
}

}  // namespace gonio
