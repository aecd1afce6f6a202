// One viewer's share of the H.264 stream: which published frames it gets. Pure logic, no sockets, no clock of its own.
// Invariants: at most kWindow frames are unacknowledged; what is sent is always decodable (after a gap only a key
// frame); the frame held back, if any, is the newest one published, so nothing new waits behind something old.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

namespace gonio {

class VideoGate {
public:
    using Time = std::chrono::steady_clock::time_point;
    static constexpr std::uint32_t kWindow = 2;  // with 2 in flight the lag stays near one frame

    enum class Verdict : std::uint8_t {
        send,  // now; the caller calls take_credit()
        hold,  // keep it instead of what is held; send it when next_held() says so
        skip,  // drop it and whatever is held
    };

    explicit VideoGate(std::chrono::milliseconds key_interval) : key_interval_(key_interval) {}

    // A frame was published. One frame may have been on its way through the encoder when the credit ran out: it is
    // held, not dropped, because dropping it would cost a key frame.
    Verdict offer(bool key) {
        if (waits_for_key_ && !key) return Verdict::skip;
        if (credit()) return Verdict::send;
        if (held_ && !key) {
            held_ = false;
            waits_for_key_ = true;
            return Verdict::skip;
        }
        held_ = true;
        held_key_ = key;
        waits_for_key_ = false;
        return Verdict::hold;
    }
    // Result: the sequence number of the frame that is sent now.
    std::uint32_t take_credit(bool key, Time now) {
        held_ = false;
        waits_for_key_ = false;
        if (key) last_key_ = now;
        return ++last_sent_;
    }
    // Acknowledgements are cumulative; of a number never sent or older than the last they change nothing.
    void acknowledge(std::uint32_t seq) {
        if (seq > last_acknowledged_ && seq <= last_sent_) last_acknowledged_ = seq;
    }
    // The viewer lost its picture (or the stream changes its size): only a key frame helps.
    void need_key() {
        held_ = false;
        waits_for_key_ = true;
    }
    // A new stream: its first key frame is not counted against the interval.
    void restart() {
        need_key();
        last_key_.reset();
    }

    bool credit() const { return last_sent_ - last_acknowledged_ < kWindow; }
    bool sends_held() const { return held_ && credit(); }
    bool held_key() const { return held_key_; }
    bool wants_frame(Time now) const { return credit() && !held_ && (!waits_for_key_ || key_due(now)); }
    bool wants_key(Time now) const { return waits_for_key_ && wants_frame(now); }
    // When wants_key turns true by the passing of time alone.
    std::optional<Time> key_due_at(Time now) const {
        if (!waits_for_key_ || !credit() || key_due(now)) return std::nullopt;
        return *last_key_ + key_interval_;
    }

private:
    bool key_due(Time now) const { return !last_key_ || now - *last_key_ >= key_interval_; }

    std::chrono::milliseconds key_interval_;
    std::uint32_t last_sent_ = 0, last_acknowledged_ = 0;
    bool waits_for_key_ = true;
    bool held_ = false, held_key_ = false;
    std::optional<Time> last_key_;
};

}  // namespace gonio
