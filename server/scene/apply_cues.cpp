#include "server/scene/apply_cues.h"

#include "protocol/schema/command.pb.h"
#include "protocol/schema/cue.pb.h"
#include "server/scene/apply_checks.h"
#include "server/scene/cue.h"
#include "server/scene/imported.h"
#include "server/scene/limits.h"
#include "server/scene/orientation.h"
#include "server/scene/preset.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

CueNumber checked_number(const std::string& text, const std::string& field) {
    const auto number = parse_cue_number(text);
    if (!number)
        refuse("invalid_argument", field, shortened_text(text, kMaxNameBytes),
               "must be a number from 0.001 to 9999.999 with at most three decimals");
    return *number;
}

const Cue& checked_cue(const Scene& scene, CueNumber number, const std::string& field) {
    const Cue* cue = find_cue(scene, number);
    if (cue == nullptr) refuse("not_found", field, print_cue_number(number), "there is no cue of this number");
    return *cue;
}

std::string checked_label(const std::string& label, const std::string& field) {
    return label.empty() ? label : checked_name(label, field);
}

// What the edit says of a cue; what it does not say stays. prefix: "add_cue."
void take_fields(const v1::CueEdit& edit, const std::string& prefix, Cue& cue) {
    if (edit.has_follow_s() && edit.has_hang_s())
        refuse("conflict", prefix + "hang_s", print_number(edit.hang_s()), "a cue has either a follow or a hang");
    if (edit.manual() && (edit.has_follow_s() || edit.has_hang_s()))
        refuse("conflict", prefix + "manual", "true", "a cue with a follow or a hang is not manual");
    const auto time = [&](double value, const char* field) {
        return checked(value, 0.0, kMaxCueTime_s, prefix + field);
    };
    if (edit.has_label()) cue.label = checked_label(edit.label(), prefix + "label");
    if (edit.has_up_s()) cue.up_s = time(edit.up_s(), "up_s");
    if (edit.has_down_s()) cue.down_s = time(edit.down_s(), "down_s");
    if (edit.has_delay_up_s()) cue.delay_up_s = time(edit.delay_up_s(), "delay_up_s");
    if (edit.has_delay_down_s()) cue.delay_down_s = time(edit.delay_down_s(), "delay_down_s");
    if (edit.manual() || edit.has_hang_s()) cue.follow_s.reset();
    if (edit.manual() || edit.has_follow_s()) cue.hang_s.reset();
    if (edit.has_follow_s()) cue.follow_s = time(edit.follow_s(), "follow_s");
    if (edit.has_hang_s()) cue.hang_s = time(edit.hang_s(), "hang_s");
    if (!edit.has_timecode()) return;
    cue.timecode.reset();
    if (edit.timecode().empty()) return;
    cue.timecode = parse_timecode(edit.timecode());
    if (!cue.timecode)
        refuse("invalid_argument", prefix + "timecode", shortened_text(edit.timecode(), kMaxNameBytes),
               "must be a time HH:MM:SS:FF, at most 23:59:59:29");
}

std::shared_ptr<const Preset> preset_named(const Scene& scene, const std::string& name, const std::string& field) {
    const auto preset = scene.presets.find(name);
    if (preset == scene.presets.end()) refuse_unknown(field, name, "preset", scene.presets);
    return preset->second;
}

// before: lights that the cue kept.
void check_lights(const Scene& scene, const Cue& cue, std::size_t before, const std::string& field) {
    const std::size_t lights = cue_lights(scene) - before + cue.content->size();
    if (lights > kMaxCueLights)
        refuse("too_large", field, std::to_string(lights),
               "all cues together keep at most " + std::to_string(kMaxCueLights) + " lights");
}

TimecodeSource checked_source(const std::string& name) {
    for (const TimecodeSource source : {TimecodeSource::off, TimecodeSource::mtc, TimecodeSource::artnet})
        if (name == timecode_source_name(source)) return source;
    refuse("invalid_argument", "set_cue_options.timecode", shortened_text(name, kMaxNameBytes),
           "must be off, mtc or artnet");
}

}  // namespace

void add_cue(Scene& scene, const v1::CueEdit& edit, const Loaded& loaded) {
    auto cue = std::make_shared<Cue>();
    cue->number = checked_number(edit.number(), "add_cue.number");
    if (find_cue(scene, cue->number) != nullptr)
        refuse("already_exists", "add_cue.number", print_cue_number(cue->number), "a cue of this number exists");
    if (scene.cues && scene.cues->size() >= kMaxCues)
        refuse("too_many_cues", "add_cue.number", print_cue_number(cue->number),
               "a scene keeps at most " + std::to_string(kMaxCues) + " cues");
    take_fields(edit, "add_cue.", *cue);
    if (!edit.has_down_s()) cue->down_s = cue->up_s;
    if (edit.has_preset())
        cue->content = preset_named(scene, edit.preset(), "add_cue.preset");
    else
        cue->content = loaded.preset ? loaded.preset : std::make_shared<const Preset>(preset_of(scene));
    check_lights(scene, *cue, 0, "add_cue.number");
    put_cue(scene, std::move(cue));
}

void set_cue(Scene& scene, const v1::CueEdit& edit) {
    const Cue& before = checked_cue(scene, checked_number(edit.number(), "set_cue.number"), "set_cue.number");
    if (edit.record() && edit.has_preset())
        refuse("conflict", "set_cue.preset", shortened_text(edit.preset(), kMaxNameBytes),
               "a cue takes the lights as they are or a preset");
    auto cue = std::make_shared<Cue>(before);
    take_fields(edit, "set_cue.", *cue);
    if (edit.has_preset()) cue->content = preset_named(scene, edit.preset(), "set_cue.preset");
    if (edit.record()) cue->content = std::make_shared<const Preset>(preset_of(scene));
    check_lights(scene, *cue, before.content->size(), "set_cue.number");
    put_cue(scene, std::move(cue));
}

void remove_cue(Scene& scene, const std::string& text) {
    const CueNumber number = checked_number(text, "remove_cue.number");
    checked_cue(scene, number, "remove_cue.number");
    erase_cue(scene, number);
}

void set_cue_options(Scene& scene, const v1::SetCueOptions& set) {
    CueOptions options = scene.cue_options;
    if (set.has_guard_s()) options.guard_s = checked(set.guard_s(), 0.0, kMostGuard_s, "set_cue_options.guard_s");
    if (set.has_back_s()) options.back_s = checked(set.back_s(), 0.0, kMaxCueTime_s, "set_cue_options.back_s");
    if (set.has_freewheel_s())
        options.freewheel_s =
            checked(set.freewheel_s(), kLeastFreewheel_s, kMostFreewheel_s, "set_cue_options.freewheel_s");
    if (set.has_timecode()) options.timecode = checked_source(set.timecode());
    if (set.has_next()) {
        const CueNumber next = checked_number(set.next(), "set_cue_options.next");
        checked_cue(scene, next, "set_cue_options.next");
        change(scene, scene.cue_next, next, scene.cue_play_rev);
    }
    change(scene, scene.cue_options, options, scene.cue_play_rev);
}

// How long it takes, where the command says so.
static void check_time(const v1::Command& command) {
    const auto check = [](const auto& timed, const char* field) {
        if (timed.has_time_s()) checked(timed.time_s(), 0.0, kMaxCueTime_s, field);
    };
    check(command.cue_goto(), "cue_goto.time_s");
    check(command.cue_back(), "cue_back.time_s");
    check(command.cue_assert(), "cue_assert.time_s");
}

CueNumber cue_meant(const Scene& scene, const v1::Command& command) {
    check_time(command);
    if (command.has_cue_goto()) {
        const CueNumber number = checked_number(command.cue_goto().number(), "cue_goto.number");
        checked_cue(scene, number, "cue_goto.number");
        return number;
    }
    if (command.has_cue_assert()) {
        if (scene.cue_active == 0) refuse("not_found", "cue_assert", "", "no cue is active");
        return checked_cue(scene, scene.cue_active, "cue_assert").number;
    }
    const bool go = command.has_cue_go();
    const CueNumber number = go ? scene.cue_next : scene.cue_active == 0 ? 0 : cue_before(scene, scene.cue_active);
    if (number == 0)
        refuse("not_found",
               go                       ? "cue_go"
               : command.has_cue_back() ? "cue_back"
                                        : "cue_stop",
               "", go ? "there is no next cue" : "there is no cue before");
    return number;
}

void play_cue(Scene& scene, const v1::Command& command, const Loaded& loaded) {
    if (command.has_cue_stop() && loaded.cue == 0) return;  // without a player nothing runs
    const CueNumber number = loaded.cue != 0 ? loaded.cue : cue_meant(scene, command);
    bring_about(scene, *find_cue(scene, number)->content, loaded.cue != 0);
    const bool again = command.has_cue_assert();  // the next one stays the next one
    change(scene, scene.cue_active, number, scene.cue_play_rev);
    if (!again) change(scene, scene.cue_next, cue_after(scene, number), scene.cue_play_rev);
}

void bring_about(Scene& scene, const Preset& preset, bool fades) {
    for (const PresetLight& kept : preset) {
        Light* light = find_light(scene, kept.name);
        if (light == nullptr) continue;
        if (!light->sun && light->profile != kept.profile) note_own_profile(scene, *light);
        if (!light->sun) change(scene, light->profile, kept.profile, light->profile_rev);
        change(scene, light->gel, kept.gel, light->level_rev);
        if (!light->sun) change(scene, light->opening, kept.opening, light->profile_rev);
        if (fades) continue;  // server/scene/preset.h or cue_player.h brings the rest in time
        // A saved show keeps a preset's angles. How the head is mounted belongs to the light.
        const bool mounted = light->world_from_mount != glm::dquat(1.0, 0.0, 0.0, 0.0);
        if (!mounted) change(scene, light->world_from_light, kept.world_from_light, light->aim_rev);
        for (const LightRow& light_row : light_rows()) change(scene, *light, light_row, numbers_of(kept, light_row));
        if (mounted && light->aim_rev == scene.scene_rev + 1)
            light->world_from_light =
                light->world_from_mount * orientation_of({light->pan_rad, light->tilt_rad, light->roll_rad});
    }
}

}  // namespace gonio
