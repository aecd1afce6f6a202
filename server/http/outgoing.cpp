#include "server/http/outgoing.h"

#include <algorithm>

namespace gonio {

using Kind = Outgoing::Kind;

static bool is_state(Kind kind) {
    return kind == Kind::state_changed || kind == Kind::whole_state;
}

static std::uint32_t microseconds(std::int64_t from_ns, std::int64_t to_ns) {
    return static_cast<std::uint32_t>(std::clamp<std::int64_t>((to_ns - from_ns) / 1000, 0, UINT32_MAX));
}

OutgoingQueue::Pushed OutgoingQueue::push(std::shared_ptr<const std::string> bytes, Kind kind,
                                          std::uint32_t scene_rev) {
    if (waiting_.size() >= limits_.queued_messages ||
        (kind == Kind::state_changed && over_bound(waiting_bytes() + bytes->size()))) {
        const std::size_t removed = std::erase_if(waiting_, [](const Outgoing& one) { return is_state(one.kind); });
        if (removed == 0 && !is_state(kind)) return Pushed::too_slow;
        waiting_.push_back({nullptr, Kind::whole_state, 0, nullptr});
        if (is_state(kind)) return Pushed::merged;
    }
    waiting_.push_back({std::move(bytes), kind, scene_rev, nullptr});
    return Pushed::queued;
}

void OutgoingQueue::push_video(std::shared_ptr<const EncodedFrame> frame, bool final, std::uint32_t seq) {
    FrameHeader header;
    header.seq = seq;
    header.key = frame->key;
    header.final = final;
    header.lane = frame->lane;
    header.scene_rev = frame->scene_rev;
    header.rendered_ns = static_cast<std::uint64_t>(frame->rendered_ns);
    header.render_us = microseconds(frame->drained_ns, frame->rendered_ns);
    header.encode_us = microseconds(std::max(frame->rendered_ns, frame->began_ns), frame->encoded_ns);
    waiting_.push_back({nullptr, Kind::video, 0, std::move(frame), encode_frame_header(header), seq});
}

void OutgoingQueue::drop_changes_until(std::uint32_t scene_rev) {
    std::erase_if(waiting_, [scene_rev](const Outgoing& one) {
        return one.kind == Kind::state_changed && one.scene_rev <= scene_rev;
    });
}

Outgoing& OutgoingQueue::begin_write() {
    outgoing_ = std::move(waiting_.front());
    waiting_.pop_front();
    writing_ = true;
    return outgoing_;
}

// A picture's bytes go with the result, not with the next message.
Outgoing OutgoingQueue::end_write() {
    writing_ = false;
    return std::exchange(outgoing_, {});
}

std::size_t OutgoingQueue::waiting_bytes() const {
    std::size_t sum = writing_ ? outgoing_.message_bytes() : 0;
    for (const Outgoing& one : waiting_) sum += one.message_bytes();
    return sum;
}

}  // namespace gonio
