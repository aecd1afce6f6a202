// The cues that play on the render thread: what hands and clients say, what time code says, and when clients are told.
// Pure: time is a parameter.
#pragma once

#include <cstdint>
#include <optional>

#include "protocol/schema/cue.pb.h"
#include "server/scene/cue_player.h"
#include "server/scene/timecode_chase.h"

namespace gonio {

inline constexpr std::int64_t kCueNews_ns = 250'000'000;  // how often clients are told of a cue's progress

class PlayedCues {
public:
    // As CuePlayer::run().
    std::optional<Error> run(Scene& scene, const v1::Command& command, std::int64_t now_ns) {
        return player_.run(scene, command, now_ns);
    }
    // Time code of that source; another one than the scene's counts for nothing.
    void hear(Scene& scene, TimecodeSource source, const Timecode& timecode, std::int64_t t_ns, std::int64_t now_ns);
    // Brings the scene to where it shall be now.
    void advance(Scene& scene, std::int64_t now_ns);
    void let_go() { player_.let_go(); }
    // Another scene took the place of the one whose cues played.
    void forget() { player_ = CuePlayer(); }

    // Whether advance() has something to do with every frame.
    bool fading() const { return player_.fading(); }
    // Result: ns until it has, INT64_MAX: never by itself.
    std::int64_t due_in_ns(const Scene& scene, std::int64_t now_ns) const;
    v1::CuePlayback playback(const Scene& scene, std::int64_t now_ns) const;
    // Result: what clients are to be told, where that is so; it counts as told.
    std::optional<v1::CuePlayback> take_news(const Scene& scene, std::int64_t now_ns);

private:
    void carry_out(Scene& scene, const std::vector<ChaseStart>& starts, std::int64_t now_ns);

    CuePlayer player_;
    TimecodeChase chase_;
    TimecodeSource source_ = TimecodeSource::off;
    v1::CuePlayback told_;
    std::int64_t told_ns_ = INT64_MIN / 2;
};

}  // namespace gonio
