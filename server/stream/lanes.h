// Who watches through which encoder. The first viewers have a lane, that is an encoder, of their own: it encodes when
// they can take a frame, at the size that their link carries. All others share one lane that follows its fastest
// member. Whoever is too slow for it waits for its next IDR. After some such waits they move to the low lane, which has
// half the rate and half the bits. Pure decisions: no sockets, no encoders, no clock; the net thread owns it.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "server/stream/bandwidth.h"
#include "server/stream/video_gate.h"

namespace gonio {

using LaneId = std::uint8_t;
inline constexpr LaneId kSharedLane = 0, kLowLane = 1, kFirstPrivateLane = 2;
inline constexpr unsigned kMostPrivateLanes = 64;

// Result: "shared", "low" or "private".
const char* lane_kind(LaneId lane);

// What a lane wants now. Wishes reach the encoders later than frames reach the viewers. `frames` and `keys` say which
// of them the request knows of, so that what is on its way between is not wished for twice.
struct LaneRequest {
    LaneId lane = kSharedLane;
    unsigned viewers = 0;
    unsigned credit = 0;                 // frames that its fastest viewer can take
    bool key = false;                    // the next one as an IDR
    std::uint32_t budget_bytes = 0;      // of a frame, by the link of its fastest viewer; 0: no limit
    std::uint32_t frames = 0, keys = 0;  // published so far
    std::uint32_t gated = 0;             // how often a viewer was made to wait for a key frame
    std::uint32_t bitrate_bps() const { return budget_bytes * 8 * 30; }  // at 30 frames a second
    bool operator==(const LaneRequest&) const = default;
};

class Lanes {
public:
    using ViewerId = std::uint32_t;
    using Time = Bandwidth::Time;
    struct Rules {
        unsigned private_lanes = 0;                    // at most kMostPrivateLanes
        std::chrono::milliseconds key_interval{1000};  // least time between two IDRs of a lane that viewers ask for
        unsigned gatings = 3;                          // within gatings_within, then the viewer moves to the low lane
        std::chrono::milliseconds gatings_within{30'000};
        // A viewer of the low lane that took every frame for so long, and so many, moves back; each time that it
        // returns the time doubles, up to 32 times.
        std::chrono::milliseconds keeps_up{10'000};
        unsigned keeps_up_frames = 50;
    };
    explicit Lanes(const Rules& rules);

    // Result: the lane that the viewer watches from now on, beginning with a key frame.
    LaneId join(ViewerId viewer, Time now);
    void leave(ViewerId viewer, Time now);
    bool watches(ViewerId viewer) const { return viewers_.contains(viewer); }
    // viewer: one that watches; here and below.
    LaneId lane_of(ViewerId viewer) const { return viewers_.at(viewer).lane; }
    std::vector<ViewerId> viewers_of(LaneId lane) const;
    // Result: the viewers that were moved to another lane since the last call. What they hold back is of no use.
    std::vector<ViewerId> take_moved();

    // An encoder of the lane made a frame. Result: what each viewer of the lane does with it.
    struct Share {
        ViewerId viewer;
        VideoGate::Verdict verdict;
    };
    std::vector<Share> published(LaneId lane, bool key, Time now);
    // The lane's next frames are of another stream (size, encoder): all its viewers need a key frame, at once.
    void restarted(LaneId lane);
    void need_key(ViewerId viewer) { viewers_.at(viewer).gate.need_key(); }

    // A frame goes to the viewer. Result: its sequence number.
    std::uint32_t take_credit(ViewerId viewer) { return viewers_.at(viewer).gate.take_credit(); }
    // Its first byte is given to the socket. Result: whether a ping is to go before it; call round_trip() when it is
    // answered.
    bool wrote(ViewerId viewer, std::uint32_t seq, std::size_t bytes, Time now);
    // Result: whether the frame held back goes out now.
    bool acknowledged(ViewerId viewer, std::uint32_t seq, Bandwidth::Duration decode, Time now);
    void round_trip(ViewerId viewer, Bandwidth::Duration time, Time now);

    // Result: one request for each lane that has viewers, by lane.
    std::vector<LaneRequest> requests(Time now) const;
    // Result: when a request changes by the passing of time alone.
    std::optional<Time> due(Time now) const;
    // Result: how often any viewer was made to wait for a key frame; never falls.
    std::uint64_t gatings() const;
    // Result: of all viewers' frames that were given to their sockets and not acknowledged.
    std::size_t bytes_in_flight() const;

private:
    struct Viewer {
        LaneId lane = kSharedLane;
        VideoGate gate;
        Bandwidth bandwidth;
        std::uint32_t written = 0;  // the last frame that was given to the socket
        std::vector<Time> gatings;  // of the last while; at most Rules::gatings
        Time good_since{};          // in the low lane: took every frame since then
        unsigned good_frames = 0;
        unsigned returns = 0;  // to the low lane
    };
    struct Lane {
        std::uint32_t frames = 0, keys = 0, gated = 0;
        std::optional<Time> last_key;
    };
    void move(ViewerId id, Viewer& viewer, LaneId lane, Time now);
    std::optional<LaneId> free_private() const;
    void gated(ViewerId id, Viewer& viewer, Time now);
    void took(ViewerId id, Viewer& viewer, Time now);
    bool key_due(const Lane& lane, Time now) const;

    Rules rules_;
    std::map<ViewerId, Viewer> viewers_;  // ids grow: in the order in which they came
    std::map<LaneId, Lane> lanes_;        // that ever had a viewer
    std::vector<ViewerId> moved_;
};

}  // namespace gonio
