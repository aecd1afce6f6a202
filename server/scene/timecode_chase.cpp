#include "server/scene/timecode_chase.h"

#include <algorithm>

#include "server/base/clock.h"

namespace gonio {
namespace {

struct Timed {
    double at_s;
    CueNumber number;
    auto operator<=>(const Timed&) const = default;
};

// Result: the cues that have a time, by it. What it is in seconds depends on the rate that comes.
std::vector<Timed> timed(const CueList& cues, TimecodeRate rate) {
    std::vector<Timed> found;
    for (const auto& cue : cues)
        if (cue->timecode) found.push_back({seconds_of({*cue->timecode, rate}), cue->number});
    std::ranges::sort(found);
    return found;
}

std::int64_t earlier(std::int64_t t_ns, double by_s) {
    return t_ns - nanoseconds_of(by_s);
}

}  // namespace

double TimecodeChase::position_s(std::int64_t now_ns, double freewheel_s) const {
    if (still_) return heard_s_;
    return heard_s_ + std::clamp(seconds_between(heard_ns_, now_ns), 0.0, freewheel_s);
}

// Forward to to_s, where it is at t_ns.
std::vector<ChaseStart> TimecodeChase::cross(double to_s, std::int64_t t_ns, const CueList& cues) {
    std::vector<ChaseStart> starts;
    if (to_s <= reached_s_) return starts;
    for (const Timed& cue : timed(cues, newest_->rate))
        if (cue.at_s > reached_s_ && cue.at_s <= to_s)
            starts.push_back({false, 0, cue.number, earlier(t_ns, to_s - cue.at_s)});
    reached_s_ = to_s;
    return starts;
}

// Of a jump while time runs: whether nothing has said yet that time is there.
bool TimecodeChase::is_doubtful(const Timecode& timecode, std::int64_t t_ns) const {
    if (!newest_ || still_ || seconds_between(heard_ns_, t_ns) > kTimecodeSilent_s) return false;
    if (!doubted_ || doubted_->timecode.rate != timecode.rate) return true;
    const double way_s = seconds_of(timecode) - seconds_of(doubted_->timecode);
    return way_s < 0 || way_s > seconds_between(doubted_->t_ns, t_ns) + kTimecodeJump_s;
}

std::vector<ChaseStart> TimecodeChase::take(const Timecode& timecode, std::int64_t t_ns, const CueList& cues,
                                            double freewheel_s, bool sure) {
    const double at_s = seconds_of(timecode);
    const bool first = !newest_ || newest_->rate != timecode.rate;
    const bool again = !first && at_s == heard_s_;
    const double expected_s = first ? at_s : position_s(t_ns, freewheel_s);
    const bool silent = !first && seconds_between(heard_ns_, t_ns) > kTimecodeSilent_s;
    const bool back = at_s < (silent && !still_ ? expected_s - kTimecodeSilent_s : heard_s_);
    const bool jumps = first || (!again && (back || at_s > expected_s + kTimecodeJump_s));
    if (jumps && !sure && is_doubtful(timecode, t_ns)) {
        doubted_ = {timecode, t_ns};
        return {};
    }
    doubted_.reset();
    newest_ = timecode;
    heard_ns_ = t_ns;
    heard_s_ = at_s;
    still_ = again;
    if (!jumps) return cross(at_s, t_ns, cues);
    reached_s_ = at_s;
    const std::vector<Timed> all = timed(cues, timecode.rate);
    const auto after = std::ranges::upper_bound(all, at_s, {}, &Timed::at_s);
    if (after == all.begin()) return {};
    const Timed& cue = *std::prev(after);
    const CueNumber before = std::prev(after) == all.begin() ? 0 : std::prev(after, 2)->number;
    return {{true, before, cue.number, earlier(t_ns, at_s - cue.at_s)}};
}

std::vector<ChaseStart> TimecodeChase::step(std::int64_t now_ns, const CueList& cues, double freewheel_s) {
    if (!newest_) return {};
    std::vector<ChaseStart> starts;
    if (doubted_ && seconds_between(doubted_->t_ns, now_ns) >= kTimecodeSilent_s) {
        const Doubted last = *doubted_;
        starts = take(last.timecode, last.t_ns, cues, freewheel_s);
    }
    const double at_s = position_s(now_ns, freewheel_s);
    // Where time held meanwhile it was there earlier than now.
    for (const ChaseStart& start : cross(at_s, heard_ns_ + nanoseconds_of(at_s - heard_s_), cues))
        starts.push_back(start);
    return starts;
}

std::optional<std::int64_t> TimecodeChase::next_ns(const CueList& cues, double freewheel_s) const {
    if (!newest_ || still_) return std::nullopt;
    std::optional<std::int64_t> next_ns;
    if (doubted_) next_ns = doubted_->t_ns + nanoseconds_of(kTimecodeSilent_s);
    for (const Timed& cue : timed(cues, newest_->rate)) {
        if (cue.at_s <= reached_s_) continue;
        const std::int64_t crossed_ns = earlier(heard_ns_, heard_s_ - cue.at_s);
        if (cue.at_s <= heard_s_ + freewheel_s) next_ns = std::min(next_ns.value_or(crossed_ns), crossed_ns);
        break;
    }
    return next_ns;
}

const char* TimecodeChase::state(std::int64_t now_ns, double freewheel_s) const {
    if (!newest_) return "waiting";
    const double silent_s = seconds_between(heard_ns_, now_ns);
    if (silent_s <= kTimecodeSilent_s) return still_ ? "holding" : "running";
    return still_ || silent_s >= freewheel_s ? "holding" : "freewheeling";
}

}  // namespace gonio
