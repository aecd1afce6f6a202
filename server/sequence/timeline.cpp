#include "server/sequence/timeline.h"

#include <algorithm>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/words.h"
#include "protocol/timecode/timecode.h"
#include "server/base/clock.h"
#include "server/base/sha256.h"
#include "server/scene/cue.h"
#include "server/scene/named_lights.h"
#include "server/scene/scene.h"
#include "server/scene/strobe.h"
#include "server/sequence/job_json.h"
#include "server/session/command_files.h"
#include "server/session/mounts.h"
#include "server/trace/exposure.h"

namespace gonio::sequence {
namespace {

using job::checked;
using job::refuse;

std::string print_words(const std::vector<std::string>& words) {
    std::string text;
    for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
    return text.size() > job::kMostShownValue ? text.substr(0, job::kMostShownValue) + "…" : text;
}

// What goes on in time is cues' and tracks'; another scene or size would be another sequence.
void check_running(const v1::Command& command, const std::vector<std::string>& words, const std::string& place) {
    if (command.has_load_scene() || command.has_open_show() || command.has_set_size() || command.has_set_technique())
        refuse(place, print_words(words), "must stand in sequence.set: it holds for all frames");
    if (command.has_recall_preset() && command.recall_preset().fade_s() > 0)
        refuse(place, print_words(words), "presets have no fade here: let a cue fade");
}

void take_exposure(Scene& scene, v1::Command& command, const std::string& place) {
    if (!command.has_set_exposure() || !command.set_exposure().automatic()) return;
    const auto ev100 = trace::metered_ev100(scene);  // at once: a job has no rest
    if (!ev100) return;
    command.mutable_set_exposure()->set_ev100(*ev100);
    checked(place, apply(scene, command, {}));
}

void apply_loaded(Scene& scene, v1::Command command, const Loaded& loaded, const std::string& place) {
    if (const auto refused = spell_out_lights(scene, command)) refuse(place, *refused);
    if (const auto refused = carry_out_mounts(scene, command, loaded)) refuse(place, *refused);
    checked(place, apply(scene, command, loaded));
    take_exposure(scene, command, place);
}

// apply_words() of a command that was read.
void apply_command(Scene& scene, v1::Command command, const SceneAccess& access, const std::string& place,
                   CuePlayer* player = nullptr, std::int64_t now_ns = 0) {
    if (player != nullptr && plays_cues(command)) {
        if (const auto refused = player->run(scene, command, now_ns)) refuse(place, *refused);
        return;
    }
    if (command.has_recall_preset()) {
        command.mutable_recall_preset()->set_fade_s(0);  // a job has no time
        if (player != nullptr) player->let_go();
    }
    const Loaded loaded = checked(place, read_files(command, access));
    apply_loaded(scene, std::move(command), loaded, place);
}

v1::Command command_of(const std::vector<std::string>& words, const std::string& place) {
    v1::Command command = checked(place, command_from_words(words));
    checked(place, attach_profile_file(command));
    return command;
}

Event event_of(const Cue& cue, const Sequence& sequence, TimecodeRate rate) {
    const double at_s = seconds_of({*cue.timecode, rate}) - *sequence.timecode_s + sequence.from_s;
    return {at_s, {"cue", "goto", print_cue_number(cue.number)}, "sequence.timecode"};
}

// A photometric file that came with a command.
std::string profile_text(const v1::Command& command) {
    if (command.has_set_light()) return command.set_light().profile().photometry();
    if (command.has_add_light()) return command.add_light().light().profile().photometry();
    if (command.has_edit_lights()) return command.edit_lights().same().profile().photometry();
    return "";
}

}  // namespace

void apply_words(Scene& scene, const std::vector<std::string>& words, const SceneAccess& access,
                 const std::string& place) {
    apply_command(scene, command_of(words, place), access, place);
}

Timeline::Timeline(Scene scene, const Sequence& sequence, const SceneAccess& access)
    : scene_(std::move(scene)), sequence_(sequence), access_(access), events_(sequence.events) {
    for (std::size_t i = 0; i < sequence.set.size(); ++i) {
        const std::string place = job::item("sequence.set", i);
        const v1::Command command = command_of(sequence.set[i], place);
        count(command);
        apply_command(scene_, command, access, place);
    }
    if (sequence.timecode_s && scene_.cues)
        for (const auto& cue : *scene_.cues)
            if (cue->timecode) events_.push_back(event_of(*cue, sequence, sequence.timecode_rate));
    std::ranges::stable_sort(events_, {}, &Event::t_s);
    std::map<std::vector<std::string>, std::size_t> known;
    for (const Track& track : sequence.tracks) {
        const auto [place, fresh] = known.emplace(track.words, groups_.size());
        if (fresh) groups_.emplace_back();
        Group& group = groups_[place->second];
        for (const Track* other : group.tracks)
            if (other->option == track.option) refuse(track.place + ".set", track.option, "has a track already");
        group.tracks.push_back(&track);
    }
}

void Timeline::count(const v1::Command& command) {
    if (const std::string text = profile_text(command); !text.empty()) files_ = sha256(files_ + text);
}

void Timeline::next() {
    const double t_s = sequence_.time_s(++frame_);
    while (next_event_ < events_.size() && events_[next_event_].t_s <= t_s) run(events_[next_event_++]);
    player_.advance(scene_, nanoseconds_of(t_s));
    for (Group& group : groups_) set(group, t_s);
    set_flashes(scene_, t_s);
}

void Timeline::run(const Event& event) {
    const std::string place = event.place + ".set";
    const std::int64_t now_ns = nanoseconds_of(event.t_s);
    const v1::Command command = command_of(event.words, place);
    check_running(command, event.words, place);
    count(command);
    player_.advance(scene_, now_ns);
    apply_command(scene_, command, access_, place, &player_, now_ns);
}

void Timeline::set(Group& group, double t_s) {
    std::vector<std::string> words = group.tracks.front()->words;
    for (const Track* track : group.tracks)  // what is no option stands before them
        if (track->option.empty()) words.push_back(value_at(*track, t_s));
    for (const Track* track : group.tracks)
        if (!track->option.empty()) words.push_back(track->option + "=" + value_at(*track, t_s));
    const std::string place =
        group.tracks.front()->place + " at frame " + std::to_string(frame_) + ", " + print_number(t_s) + " s";
    if (words != group.said) {
        group.command = command_of(words, place);
        check_running(group.command, words, place);
        if (plays_cues(group.command) || group.command.has_add_light() || group.command.has_remove_light())
            refuse(place, print_words(words), "is done once: it is an event");
        count(group.command);
        group.loaded = checked(place, read_files(group.command, access_));
        group.said = std::move(words);
    }
    apply_loaded(scene_, group.command, group.loaded, place);
}

}  // namespace gonio::sequence
