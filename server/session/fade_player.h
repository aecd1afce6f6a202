// The fade of a preset that runs, and whose recall it is. Pure: time is a parameter.
#pragma once

#include "protocol/schema/gonio.pb.h"
#include "server/scene/preset.h"

namespace gonio {

class FadePlayer {
public:
    // Begins where the command is a recall; one without a fade ends the fade that runs. The preset is in the scene.
    void begin(const Scene& scene, const v1::Command& command, std::uint32_t by, std::int64_t now_ns) {
        if (!command.has_recall_preset()) return;
        const v1::RecallPreset& recall = command.recall_preset();
        by_ = by;
        fade_ = recall.fade_s() > 0 ? Fade(scene, *scene.presets.at(recall.name()), recall.fade_s(), now_ns) : Fade();
    }
    bool running() const { return fade_.running(); }
    std::uint32_t by() const { return by_; }
    // Result: the commands that bring the scene to where it shall be.
    std::vector<v1::Command> step(const Scene& scene, std::int64_t now_ns) { return fade_.step(scene, now_ns); }

private:
    Fade fade_;
    std::uint32_t by_ = 0;
};

}  // namespace gonio
