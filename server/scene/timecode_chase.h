// What time code that arrives does to the list of cues: a cue whose time is crossed forward is started. After a jump
// the state at that time is there, without what lies between. When it ends, time goes on by itself for a while, then it
// holds. Pure: time is a parameter.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "protocol/timecode/timecode.h"
#include "server/scene/cue.h"

namespace gonio {

inline constexpr double kTimecodeJump_s = 0.5;  // farther ahead than that of where it should be, or back: a jump
inline constexpr double kTimecodeSilent_s =
    0.2;  // without a message for so long it has ended; MIDI brings one in 0.083 s

// What CuePlayer is to do, in order.
struct ChaseStart {
    bool jumped = false;
    CueNumber before = 0;  // of a jump: the cue of the list before it, by time; 0: none
    CueNumber number = 0;
    std::int64_t began_ns = 0;
};

class TimecodeChase {
public:
    // Time code that came at t_ns. Result: the cues to start. sure: it was compared with what came before, as
    // MtcReader does. Otherwise a jump while time runs counts once the next time agrees with it, or once nothing has
    // come for kTimecodeSilent_s after it: a single wrong packet starts nothing.
    std::vector<ChaseStart> take(const Timecode& timecode, std::int64_t t_ns, const CueList& cues, double freewheel_s,
                                 bool sure = true);
    // What time brings without a message.
    std::vector<ChaseStart> step(std::int64_t now_ns, const CueList& cues, double freewheel_s);
    // Result: when step() starts a cue; nothing: it does not.
    std::optional<std::int64_t> next_ns(const CueList& cues, double freewheel_s) const;
    // As CuePlayback.chase names it: "waiting" "running" "freewheeling" "holding".
    const char* state(std::int64_t now_ns, double freewheel_s) const;
    const std::optional<Timecode>& newest() const { return newest_; }
    void forget() { *this = TimecodeChase(); }

private:
    struct Doubted {
        Timecode timecode;
        std::int64_t t_ns = 0;
    };
    std::vector<ChaseStart> cross(double to_s, std::int64_t t_ns, const CueList& cues);
    double position_s(std::int64_t now_ns, double freewheel_s) const;
    bool is_doubtful(const Timecode& timecode, std::int64_t t_ns) const;

    std::optional<Timecode> newest_;
    std::int64_t heard_ns_ = 0;
    double heard_s_ = 0;              // real seconds since midnight
    double reached_s_ = 0;            // cues up to here were started
    bool still_ = false;              // the same time came twice
    std::optional<Doubted> doubted_;  // a jump that nothing has confirmed yet
};

}  // namespace gonio
