#include "server/stream/lanes.h"

#include <algorithm>
#include <utility>

namespace gonio {

const char* lane_kind(LaneId lane) {
    return lane == kSharedLane ? "shared" : lane == kLowLane ? "low" : "private";
}

Lanes::Lanes(const Rules& rules) : rules_(rules) {
    rules_.private_lanes = std::min(rules_.private_lanes, kMostPrivateLanes);
}

LaneId Lanes::join(ViewerId id, Time now) {
    Viewer& viewer = viewers_[id] = Viewer{};
    viewer.lane = free_private().value_or(kSharedLane);
    // Who owned this lane before is no reason to wait.
    if (viewer.lane >= kFirstPrivateLane) lanes_[viewer.lane].last_key.reset();
    viewer.good_since = now;
    lanes_[viewer.lane];
    return viewer.lane;
}

void Lanes::leave(ViewerId id, Time now) {
    viewers_.erase(id);
    std::erase(moved_, id);
    // The lane goes to whoever has shared one for the longest.
    for (auto& [waiting, viewer] : viewers_) {
        if (viewer.lane >= kFirstPrivateLane) continue;
        if (const auto free = free_private()) move(waiting, viewer, *free, now);
        return;
    }
}

std::optional<LaneId> Lanes::free_private() const {
    std::vector<bool> taken(rules_.private_lanes);
    for (const auto& [id, viewer] : viewers_)
        if (viewer.lane >= kFirstPrivateLane) taken[viewer.lane - kFirstPrivateLane] = true;
    const auto free = std::find(taken.begin(), taken.end(), false);
    if (free == taken.end()) return std::nullopt;
    return static_cast<LaneId>(kFirstPrivateLane + (free - taken.begin()));
}

std::vector<Lanes::ViewerId> Lanes::viewers_of(LaneId lane) const {
    std::vector<ViewerId> ids;
    for (const auto& [id, viewer] : viewers_)
        if (viewer.lane == lane) ids.push_back(id);
    return ids;
}

std::vector<Lanes::ViewerId> Lanes::take_moved() {
    return std::exchange(moved_, {});
}

void Lanes::move(ViewerId id, Viewer& viewer, LaneId lane, Time now) {
    viewer.lane = lane;
    viewer.gate.need_key();
    viewer.gatings.clear();
    viewer.good_since = now;
    viewer.good_frames = 0;
    if (lane >= kFirstPrivateLane) lanes_[lane].last_key.reset();
    lanes_[lane];
    moved_.push_back(id);
}

std::vector<Lanes::Share> Lanes::published(LaneId lane_id, bool key, Time now) {
    Lane& lane = lanes_[lane_id];
    ++lane.frames;
    if (key) {
        ++lane.keys;
        lane.last_key = now;
    }
    std::vector<Share> shares;
    for (auto& [id, viewer] : viewers_) {
        if (viewer.lane != lane_id) continue;
        const bool waited = viewer.gate.waits_for_key();
        const VideoGate::Verdict verdict = viewer.gate.offer(key);
        shares.push_back({id, verdict});
        if (!waited && viewer.gate.waits_for_key()) {
            ++lane.gated;
            gated(id, viewer, now);
        } else if (verdict == VideoGate::Verdict::send) {
            took(id, viewer, now);
            if (viewer.lane != lane_id) shares.back().verdict = VideoGate::Verdict::skip;
        } else {
            viewer.good_since = now;
            viewer.good_frames = 0;
        }
    }
    return shares;
}

void Lanes::gated(ViewerId id, Viewer& viewer, Time now) {
    viewer.good_since = now;
    viewer.good_frames = 0;
    if (viewer.lane != kSharedLane) return;
    std::erase_if(viewer.gatings, [&](Time then) { return now - then > rules_.gatings_within; });
    viewer.gatings.push_back(now);
    if (viewer.gatings.size() < rules_.gatings) return;
    move(id, viewer, kLowLane, now);
    viewer.returns = std::min(viewer.returns + 1, 6u);
}

void Lanes::took(ViewerId id, Viewer& viewer, Time now) {
    ++viewer.good_frames;
    if (viewer.lane != kLowLane || viewer.good_frames < rules_.keeps_up_frames) return;
    const auto proof = rules_.keeps_up * (1 << (std::max(viewer.returns, 1u) - 1));
    if (now - viewer.good_since >= proof) move(id, viewer, kSharedLane, now);
}

void Lanes::restarted(LaneId lane) {
    lanes_[lane].last_key.reset();
    for (auto& [id, viewer] : viewers_)
        if (viewer.lane == lane) viewer.gate.need_key();
}

bool Lanes::wrote(ViewerId id, std::uint32_t seq, std::size_t bytes, Time now) {
    Viewer& viewer = viewers_.at(id);
    const bool alone = viewer.bandwidth.window(now) > 1;  // it narrows to 1 while frames are on their way before a ping
    const bool probe = alone && viewer.bandwidth.wants_probe(now);
    if (probe) viewer.bandwidth.probed(now);
    viewer.written = seq;
    viewer.bandwidth.wrote(seq, bytes, now);
    viewer.gate.set_window(viewer.bandwidth.window(now));
    return probe;
}

bool Lanes::acknowledged(ViewerId id, std::uint32_t seq, Bandwidth::Duration decode, Time now) {
    Viewer& viewer = viewers_.at(id);
    // Nobody can have what was not written yet: the acknowledgement would only open the way for more.
    if (seq <= viewer.written && viewer.gate.acknowledge(seq)) viewer.bandwidth.acknowledged(seq, decode, now);
    viewer.gate.set_window(viewer.bandwidth.window(now));
    return viewer.gate.sends_held();
}

void Lanes::round_trip(ViewerId id, Bandwidth::Duration time, Time now) {
    viewers_.at(id).bandwidth.round_trip(time, now);
}

bool Lanes::key_due(const Lane& lane, Time now) const {
    return !lane.last_key || now - *lane.last_key >= rules_.key_interval;
}

std::vector<LaneRequest> Lanes::requests(Time now) const {
    constexpr std::uint32_t kUnlimited = UINT32_MAX;
    std::map<LaneId, LaneRequest> requests;
    for (const auto& [id, viewer] : viewers_) {
        const Lane& lane = lanes_.at(viewer.lane);
        auto [at, fresh] = requests.try_emplace(viewer.lane);
        LaneRequest& request = at->second;
        if (fresh) {
            request.lane = viewer.lane;
            request.frames = lane.frames;
            request.keys = lane.keys;
            request.gated = lane.gated;
        }
        ++request.viewers;
        const bool waits = viewer.gate.waits_for_key();
        if (!waits) {  // whoever waits does not lead
            const std::uint32_t budget = viewer.bandwidth.frame_budget_bytes();
            request.budget_bytes = std::max(request.budget_bytes, budget == 0 ? kUnlimited : budget);
        }
        if (waits && !key_due(lane, now)) continue;  // a delta would be of no use to it
        const std::uint32_t spare = viewer.gate.spare();
        request.credit = std::max(request.credit, spare);
        request.key = request.key || (waits && spare > 0);
    }
    std::vector<LaneRequest> result;
    for (auto& [id, request] : requests) {
        // Nobody leads: all wait for the key frame that this request is about.
        for (const auto& [viewer_id, viewer] : viewers_) {
            if (request.budget_bytes == 0 && viewer.lane == id)
                request.budget_bytes = viewer.bandwidth.frame_budget_bytes();
        }
        if (request.budget_bytes == kUnlimited) request.budget_bytes = 0;
        result.push_back(request);
    }
    return result;
}

std::uint64_t Lanes::gatings() const {
    std::uint64_t sum = 0;
    for (const auto& [id, lane] : lanes_) sum += lane.gated;
    return sum;
}

std::size_t Lanes::bytes_in_flight() const {
    std::size_t sum = 0;
    for (const auto& [id, viewer] : viewers_) sum += viewer.bandwidth.bytes_in_flight();
    return sum;
}

std::optional<Lanes::Time> Lanes::due(Time now) const {
    std::optional<Time> soonest;
    for (const auto& [id, viewer] : viewers_) {
        const Lane& lane = lanes_.at(viewer.lane);
        if (!viewer.gate.waits_for_key() || viewer.gate.spare() == 0 || key_due(lane, now)) continue;
        const Time at = *lane.last_key + rules_.key_interval;
        soonest = soonest ? std::min(*soonest, at) : at;
    }
    return soonest;
}

}  // namespace gonio
