#include "server/scene/cue.h"

#include <algorithm>

#include "protocol/schema/cue.pb.h"
#include "server/scene/scene.h"

namespace gonio {

static constexpr auto kNumber = [](const std::shared_ptr<const Cue>& cue) { return cue->number; };

static CueList::const_iterator at_or_after(const CueList& cues, CueNumber number) {
    return std::ranges::lower_bound(cues, number, {}, kNumber);
}

std::shared_ptr<const Cue> cue_of(const Scene& scene, CueNumber number) {
    if (!scene.cues) return nullptr;
    const auto at = at_or_after(*scene.cues, number);
    return at == scene.cues->end() || (*at)->number != number ? nullptr : *at;
}

const Cue* find_cue(const Scene& scene, CueNumber number) {
    return cue_of(scene, number).get();
}

CueNumber cue_after(const Scene& scene, CueNumber number) {
    if (!scene.cues) return 0;
    const auto at = at_or_after(*scene.cues, number + 1);
    return at == scene.cues->end() ? 0 : (*at)->number;
}

CueNumber cue_before(const Scene& scene, CueNumber number) {
    if (!scene.cues) return 0;
    const auto at = at_or_after(*scene.cues, number);
    return at == scene.cues->begin() ? 0 : (*std::prev(at))->number;
}

void put_cue(Scene& scene, std::shared_ptr<const Cue> cue) {
    const CueNumber number = cue->number;
    auto cues = std::make_shared<CueList>(scene.cues ? *scene.cues : CueList());
    const auto at = std::ranges::lower_bound(*cues, number, {}, kNumber);
    const bool there = at != cues->end() && (*at)->number == number;
    if (there)
        *at = std::move(cue);
    else
        cues->insert(at, std::move(cue));
    scene.cues = std::move(cues);
    scene.cues_rev = scene.scene_rev + 1;
    if (there || number <= scene.cue_active || (scene.cue_next != 0 && number >= scene.cue_next)) return;
    scene.cue_next = number;
    scene.cue_play_rev = scene.scene_rev + 1;
}

void erase_cue(Scene& scene, CueNumber number) {
    if (find_cue(scene, number) == nullptr) return;
    auto cues = std::make_shared<CueList>(*scene.cues);
    cues->erase(std::ranges::lower_bound(*cues, number, {}, kNumber));
    scene.cues = std::move(cues);
    scene.cues_rev = scene.scene_rev + 1;
    if (scene.cue_next != number) return;
    scene.cue_next = cue_after(scene, number);
    scene.cue_play_rev = scene.scene_rev + 1;
}

std::size_t cue_lights(const Scene& scene) {
    std::size_t lights = 0;
    if (scene.cues)
        for (const auto& cue : *scene.cues) lights += cue->content->size();
    return lights;
}

const char* timecode_source_name(TimecodeSource source) {
    return source == TimecodeSource::mtc ? "mtc" : source == TimecodeSource::artnet ? "artnet" : "off";
}

void put_cue(const Cue& cue, v1::Cue& out) {
    out.set_number(print_cue_number(cue.number));
    out.set_label(cue.label);
    out.set_up_s(cue.up_s);
    out.set_down_s(cue.down_s);
    out.set_delay_up_s(cue.delay_up_s);
    out.set_delay_down_s(cue.delay_down_s);
    if (cue.follow_s) out.set_follow_s(*cue.follow_s);
    if (cue.hang_s) out.set_hang_s(*cue.hang_s);
    if (cue.timecode) out.set_timecode(print_timecode(*cue.timecode));
}

}  // namespace gonio
