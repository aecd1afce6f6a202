// Which lane is given which picture, and when. A lane gets the newest when one of its viewers can take it, then repeats
// of it that sharpen what a narrow link blurred, then nothing. Render thread.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "server/stream/lane_encoders.h"
#include "server/stream/lanes.h"

namespace gonio {

class LaneFeed {
public:
    explicit LaneFeed(LaneEncoders& encoders) : encoders_(encoders) {}

    // A new picture, at `now_ns` of the monotonic clock.
    void show(Picture picture, std::int64_t now_ns);
    const Picture& newest() const { return newest_; }
    // What viewers want now. jpeg: an MJPEG client took the last part; jpeg_clients: all of them.
    void want(std::vector<LaneRequest> requests, bool jpeg, unsigned jpeg_clients);
    // The newest picture was given to this lane by the trial.
    void tried(LaneId lane);

    // Whether somebody can take another picture: only then one is rendered.
    bool wanted() const;
    // Whether somebody could, were the encoders not at work.
    bool watched() const;
    // Gives pictures to the lanes that are ready. more: a newer picture is about to be made; settled: none will come
    // until something changes.
    void serve(std::int64_t now_ns, bool more, bool settled);
    // Result: when a repeat is due, ns from now; INT64_MAX: none.
    std::int64_t rest_in_ns(std::int64_t now_ns) const;
    // Whether all that can be said of the newest picture was said; a viewer that does not answer is not waited for.
    bool at_rest(std::int64_t now_ns) const;

    struct Row {
        LaneRequest request;
        LaneEncoders::Counts counts;
    };
    std::vector<Row> rows() const;

    // A picture is repeated when no newer one came for so long, at most so often until it is final.
    static constexpr std::int64_t kQuietNs = 100'000'000;
    static constexpr unsigned kRepeats = 8;

private:
    struct Lane {
        std::uint64_t picture = 0;               // number of the last one it was given
        unsigned repeats = 0;                    // of that one
        std::optional<std::uint32_t> still_rev;  // revision of the scene at which it was repeated
        std::int64_t given_ns = 0, empty_since_ns = 0;
    };
    enum class Turn : std::uint8_t { none, picture, key, repeat };
    Turn turn(const LaneRequest& request, std::int64_t now_ns, bool more, bool settled) const;
    bool can_take(const LaneRequest& request) const;
    void give(const LaneRequest& request, Turn turn, std::int64_t now_ns, bool settled);
    void close_empty(std::int64_t now_ns);

    LaneEncoders& encoders_;
    Picture newest_;
    std::uint64_t number_ = 0;  // of the newest picture
    std::int64_t shown_ns_ = 0;
    std::vector<LaneRequest> requests_;
    std::map<LaneId, Lane> lanes_;
    bool jpeg_ = false, settled_ = false, more_ = false;
    unsigned jpeg_clients_ = 0;
    std::uint64_t jpeg_picture_ = 0;
};

}  // namespace gonio
