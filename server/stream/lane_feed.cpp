#include "server/stream/lane_feed.h"

#include <algorithm>

namespace gonio {
namespace {

constexpr std::int64_t kPatienceNs = 1'000'000'000;    // with a viewer that does not acknowledge
constexpr std::int64_t kCloseEmptyNs = 5'000'000'000;  // the encoder of a lane without viewers
constexpr double kLowerCrf = 6;                        // by so much in the low lane: half the bits
constexpr std::uint64_t kLowEvery = 2;                 // half the rate

}  // namespace

void LaneFeed::show(Picture picture, std::int64_t now_ns) {
    newest_ = std::move(picture);
    ++number_;
    shown_ns_ = now_ns;
}

void LaneFeed::want(std::vector<LaneRequest> requests, bool jpeg, unsigned jpeg_clients) {
    requests_ = std::move(requests);
    if (jpeg_clients_ == 0) jpeg_picture_ = 0;  // whoever comes first has not seen the newest picture
    jpeg_ = jpeg;
    jpeg_clients_ = jpeg_clients;
}

void LaneFeed::tried(LaneId lane) {
    lanes_[lane].picture = number_;
}

// Frames that the viewers' side does not know of yet have taken their credit already.
bool LaneFeed::can_take(const LaneRequest& request) const {
    return request.credit > encoders_.counts(request.lane).frames - request.frames;
}

bool LaneFeed::watched() const {
    return jpeg_ || (encoders_.works() && std::any_of(requests_.begin(), requests_.end(),
                                                      [](const LaneRequest& request) { return request.credit > 0; }));
}

bool LaneFeed::wanted() const {
    if (jpeg_ && encoders_.takes_jpeg()) return true;
    return std::any_of(requests_.begin(), requests_.end(),
                       [&](const LaneRequest& request) { return encoders_.takes(request.lane) && can_take(request); });
}

LaneFeed::Turn LaneFeed::turn(const LaneRequest& request, std::int64_t now_ns, bool more, bool settled) const {
    if (!encoders_.takes(request.lane) || !can_take(request)) return Turn::none;
    const auto found = lanes_.find(request.lane);
    const Lane lane = found == lanes_.end() ? Lane{} : found->second;
    const LaneEncoders::Counts counts = encoders_.counts(request.lane);
    if (request.key && counts.keys == request.keys && encoders_.idle(request.lane)) return Turn::key;
    if (lane.picture != number_) {
        const bool waits = request.lane == kLowLane && more && number_ - lane.picture < kLowEvery;
        return waits ? Turn::none : Turn::picture;
    }
    if (more || !encoders_.idle(request.lane) || now_ns - shown_ns_ < kQuietNs || counts.final) return Turn::none;
    if (counts.sharp && !settled) return Turn::none;
    return lane.repeats < kRepeats || settled ? Turn::repeat : Turn::none;
}

void LaneFeed::give(const LaneRequest& request, Turn turn, std::int64_t now_ns, bool settled) {
    Lane& lane = lanes_[request.lane];
    lane.repeats = turn == Turn::repeat ? lane.repeats + 1 : 0;
    lane.picture = number_;
    lane.given_ns = now_ns;
    if (turn == Turn::repeat) lane.still_rev = newest_.scene_rev;
    // Refined pictures of a scene at rest too. Not key frames: whoever waits for one would wait for twice its size.
    const bool fine = turn != Turn::key && lane.still_rev == newest_.scene_rev;
    const double crf = (fine ? kStillCrf : kCrf) + (request.lane == kLowLane ? kLowerCrf : 0.0);
    encoders_.put(request.lane, {.picture = newest_,
                                 .request = {turn == Turn::key, request.budget_bytes, crf},
                                 .settled = settled,
                                 .last = lane.repeats >= kRepeats,
                                 .fine = fine});
}

void LaneFeed::serve(std::int64_t now_ns, bool more, bool settled) {
    more_ = more;
    settled_ = settled;
    for (const LaneId lost : encoders_.check()) lanes_[lost].picture = 0;
    if (number_ == 0) return;
    for (const LaneRequest& request : requests_) {
        const Turn its = turn(request, now_ns, more, settled);
        if (its != Turn::none) give(request, its, now_ns, settled);
    }
    if (jpeg_ && jpeg_picture_ != number_ && encoders_.takes_jpeg()) {
        jpeg_picture_ = number_;
        encoders_.put_jpeg(newest_);
    }
    close_empty(now_ns);
}

void LaneFeed::close_empty(std::int64_t now_ns) {
    for (auto lane = lanes_.begin(); lane != lanes_.end();) {
        const bool viewers = std::any_of(requests_.begin(), requests_.end(),
                                         [&](const LaneRequest& request) { return request.lane == lane->first; });
        std::int64_t& since = lane->second.empty_since_ns;
        since = viewers ? 0 : since == 0 ? now_ns : since;
        if (viewers || now_ns - since < kCloseEmptyNs) {
            ++lane;
        } else {
            encoders_.close(lane->first);
            lane = lanes_.erase(lane);
        }
    }
}

std::int64_t LaneFeed::rest_in_ns(std::int64_t now_ns) const {
    const std::int64_t quiet_at_ns = std::max(now_ns, shown_ns_ + kQuietNs);
    const bool repeats = std::any_of(requests_.begin(), requests_.end(), [&](const LaneRequest& request) {
        return turn(request, quiet_at_ns, more_, settled_) == Turn::repeat;
    });
    return repeats ? quiet_at_ns - now_ns : INT64_MAX;
}

bool LaneFeed::at_rest(std::int64_t now_ns) const {
    if (jpeg_ && jpeg_picture_ != number_) return false;
    if (!encoders_.works()) return true;
    return std::all_of(requests_.begin(), requests_.end(), [&](const LaneRequest& request) {
        const auto found = lanes_.find(request.lane);
        if (found == lanes_.end()) return request.credit == 0;
        if (!encoders_.idle(request.lane)) return false;
        if (found->second.picture == number_ && encoders_.counts(request.lane).final) return !request.key;
        return !can_take(request) && now_ns - found->second.given_ns > kPatienceNs;
    });
}

std::vector<LaneFeed::Row> LaneFeed::rows() const {
    std::vector<Row> rows;
    for (const LaneRequest& request : requests_) rows.push_back({request, encoders_.counts(request.lane)});
    return rows;
}

}  // namespace gonio
