// One viewer's share of its lane's stream: which frames it gets. Pure logic, no sockets, no clock.
// Invariants: at most `window` frames are unacknowledged. What is sent is always decodable (after a gap only a key
// frame). The frame held back, if any, is the newest one published, so nothing new waits behind something old.
#pragma once

#include <cstdint>

namespace gonio {

class VideoGate {
public:
    static constexpr std::uint32_t kWindow = 2;  // with 2 in flight the lag stays near one frame

    enum class Verdict : std::uint8_t {
        send,  // now; the caller calls take_credit()
        hold,  // keep it instead of what is held; send it when sends_held() says so
        skip,  // drop it and whatever is held
    };

    // A frame of the lane was published. One frame may have been on its way through the encoder when the credit ran
    // out: it is held, not dropped, because dropping it would cost a key frame.
    Verdict offer(bool key) {
        if (waits_for_key_ && !key) return Verdict::skip;
        if (credit() > 0) return Verdict::send;
        if (held_ && !key) {
            held_ = false;
            waits_for_key_ = true;
            return Verdict::skip;
        }
        held_ = true;
        waits_for_key_ = false;
        return Verdict::hold;
    }
    // Result: the sequence number of the frame that is sent now.
    std::uint32_t take_credit() {
        held_ = false;
        waits_for_key_ = false;
        return ++last_sent_;
    }
    // Acknowledgements are cumulative; of a number never sent or older than the last they change nothing. Result:
    // whether it was a good one.
    bool acknowledge(std::uint32_t seq) {
        if (seq <= last_acknowledged_ || seq > last_sent_) return false;
        last_acknowledged_ = seq;
        return true;
    }
    // The viewer lost its picture, or gets another stream from now on: only a key frame helps.
    void need_key() {
        held_ = false;
        waits_for_key_ = true;
    }
    void set_window(std::uint32_t frames) { window_ = frames; }

    // Result: how many frames may be sent now.
    std::uint32_t credit() const {
        const std::uint32_t in_flight = last_sent_ - last_acknowledged_;
        return in_flight < window_ ? window_ - in_flight : 0;
    }
    // Result: how many more the viewer can take, beside the one held back.
    std::uint32_t spare() const { return held_ ? 0 : credit(); }
    bool sends_held() const { return held_ && credit() > 0; }
    bool waits_for_key() const { return waits_for_key_; }

private:
    std::uint32_t window_ = kWindow;
    std::uint32_t last_sent_ = 0, last_acknowledged_ = 0;
    bool waits_for_key_ = true, held_ = false;
};

}  // namespace gonio
