#include "server/session/played_cues.h"

#include <algorithm>

#include "protocol/schema/cue.pb.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

const CueList& cues_of(const Scene& scene) {
    static const CueList none;
    return scene.cues ? *scene.cues : none;
}

// Without what goes on by itself.
std::string standing(v1::CuePlayback playback) {
    playback.clear_progress_ratio();
    playback.clear_remaining_s();
    if (playback.has_next_in_s()) playback.set_next_in_s(0);
    playback.clear_timecode();
    return playback.SerializeAsString();
}

}  // namespace

void PlayedCues::carry_out(Scene& scene, const std::vector<ChaseStart>& starts, std::int64_t now_ns) {
    for (const ChaseStart& start : starts) {
        if (start.jumped)
            player_.jump(scene, start.before, start.number, start.began_ns, now_ns);
        else
            player_.start(scene, start.number, start.began_ns, now_ns);
    }
}

void PlayedCues::hear(Scene& scene, TimecodeSource source, const Timecode& timecode, std::int64_t t_ns,
                      std::int64_t now_ns) {
    if (source == TimecodeSource::off || source != scene.cue_options.timecode) return;
    if (std::exchange(source_, source) != source) chase_.forget();
    const bool sure = source == TimecodeSource::mtc;
    carry_out(scene, chase_.take(timecode, t_ns, cues_of(scene), scene.cue_options.freewheel_s, sure), now_ns);
}

void PlayedCues::advance(Scene& scene, std::int64_t now_ns) {
    if (scene.cue_options.timecode == source_ && source_ != TimecodeSource::off)
        carry_out(scene, chase_.step(now_ns, cues_of(scene), scene.cue_options.freewheel_s), now_ns);
    player_.advance(scene, now_ns);
}

std::int64_t PlayedCues::due_in_ns(const Scene& scene, std::int64_t now_ns) const {
    std::int64_t due_ns = INT64_MAX;
    if (const auto next_ns = player_.next_ns()) due_ns = std::max<std::int64_t>(0, *next_ns - now_ns);
    if (scene.cue_options.timecode == source_ && source_ != TimecodeSource::off)
        if (const auto next_ns = chase_.next_ns(cues_of(scene), scene.cue_options.freewheel_s))
            due_ns = std::min(due_ns, std::max<std::int64_t>(0, *next_ns - now_ns));
    return due_ns;
}

v1::CuePlayback PlayedCues::playback(const Scene& scene, std::int64_t now_ns) const {
    v1::CuePlayback playback = player_.playback(scene, now_ns);
    if (scene.cue_options.timecode == TimecodeSource::off) {
        playback.set_chase("off");
    } else if (scene.cue_options.timecode != source_) {
        playback.set_chase("waiting");
    } else {
        playback.set_chase(chase_.state(now_ns, scene.cue_options.freewheel_s));
        if (chase_.newest()) playback.set_timecode(print_timecode(chase_.newest()->label));
    }
    return playback;
}

std::optional<v1::CuePlayback> PlayedCues::take_news(const Scene& scene, std::int64_t now_ns) {
    v1::CuePlayback now = playback(scene, now_ns);
    const bool goes_on = now.running() || now.timecode() != told_.timecode();
    const bool news = standing(now) != standing(told_) || (goes_on && !now.held() && now_ns - told_ns_ >= kCueNews_ns);
    if (!news) return std::nullopt;
    told_ = now;
    told_ns_ = now_ns;
    return now;
}

}  // namespace gonio
