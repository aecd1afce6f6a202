// What plays the list of cues: GO, BACK, STOP, GOTO, the fades that they begin, and follows and hangs. Pure: time is a
// parameter, and what it does to the scene goes through apply().
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "ies/core/result.h"
#include "protocol/schema/messages.h"
#include "server/scene/cue.h"
#include "server/scene/light_values.h"

namespace gonio {

// Result: whether a CuePlayer carries the command out.
bool plays_cues(const v1::Command& command);

class CuePlayer {
public:
    // Carries out such a command at now_ns, and brings the scene to where it is then. Result: why not; then nothing has
    // changed. Errors: those of apply(); "too_soon" of a GO within CueOptions::guard_s after another.
    std::optional<Error> run(Scene& scene, const v1::Command& command, std::int64_t now_ns);
    // The same of time code: the cue as if it had been started then.
    void start(Scene& scene, CueNumber number, std::int64_t began_ns, std::int64_t now_ns);
    // At the state of that cue at once, as if `before` (0: nothing) had ended when it was started at began_ns.
    void jump(Scene& scene, CueNumber before, CueNumber number, std::int64_t began_ns, std::int64_t now_ns);
    // Brings the scene to where it shall be at now_ns: fades, and the cues that follow.
    void advance(Scene& scene, std::int64_t now_ns);
    // Another hand has the lights: what runs ends where it is.
    void let_go() { parts_.clear(); }

    // Whether advance() moves something with every frame.
    bool fading() const { return !parts_.empty() && !held_ns_; }
    // Result: when advance() starts the next cue; nothing: it does not.
    std::optional<std::int64_t> next_ns() const { return held_ns_ ? std::nullopt : next_ns_; }
    // Whether a cue's time is not over, or another one follows.
    bool running(std::int64_t now_ns) const;
    // Of State, without what is told of time code.
    v1::CuePlayback playback(const Scene& scene, std::int64_t now_ns) const;

private:
    struct Times {
        double up_s, down_s, delay_up_s, delay_down_s;
    };
    // One property of one light.
    struct Part {
        std::uint32_t light;  // Light::id
        const LightRow* light_row;
        Numbers from, to, said;  // said: as this player wrote it last, or found it
        std::int64_t began_ns;
        double delay_s, time_s;
        Numbers at(std::int64_t t_ns) const;
        bool over(std::int64_t t_ns) const;
    };
    void begin(Scene& scene, const v1::Command& command, CueNumber number, std::optional<double> time_s, bool goes_on,
               std::int64_t began_ns);
    void take_content(const Scene& scene, const Cue& cue, const Times& times, std::int64_t began_ns);
    void write(Scene& scene, std::int64_t now_ns);
    void follow(const Scene& scene);
    void hold(Scene& scene, std::int64_t now_ns);
    void go_on(std::int64_t now_ns);

    std::vector<Part> parts_;  // by light, then in the order of light_rows()
    CueNumber active_ = 0;
    std::int64_t began_ns_ = 0, ends_ns_ = 0;  // of the active cue
    std::optional<std::int64_t> next_ns_, held_ns_, go_ns_;
};

}  // namespace gonio
