// What waits to be sent to a WebSocket client. Net thread; knows no sockets.
#pragma once

#include <array>
#include <deque>
#include <memory>
#include <string>

#include "protocol/schema/frame_header.h"
#include "server/http/http_limits.h"
#include "server/stream/encoder.h"

namespace gonio {

struct Outgoing {
    // reply: ends a request that counts as outstanding; note: any other message that is no state.
    enum class Kind : std::uint8_t { note, reply, state_changed, whole_state, video };
    std::shared_ptr<const std::string> bytes;  // of messages; of whole_state from its sending on
    Kind kind = Kind::note;
    std::uint32_t scene_rev = 0;                // of state_changed
    std::shared_ptr<const EncodedFrame> frame;  // of video, with its header
    std::array<std::byte, kFrameHeaderBytes> header{};
    std::uint32_t seq = 0;
    std::size_t message_bytes() const { return bytes ? bytes->size() : 0; }
};

// Messages leave in the order in which they were pushed, so that no frame overtakes its VideoConfig. At most
// HttpLimits::queued_messages and queued_bytes wait, and a whole state.
class OutgoingQueue {
public:
    explicit OutgoingQueue(const HttpLimits& limits) : limits_(limits) {}

    // At the bound all waiting changes of the state become one message with the whole state, encoded when it is sent.
    // If this one did: merged. If the client lets answers pile up: too_slow.
    enum class Pushed : std::uint8_t { queued, merged, too_slow };
    Pushed push(std::shared_ptr<const std::string> bytes, Outgoing::Kind kind, std::uint32_t scene_rev);
    void push_video(std::shared_ptr<const EncodedFrame> frame, bool final, std::uint32_t seq);
    // Changes up to this revision are in the whole state that is sent now: revisions never go back.
    void drop_changes_until(std::uint32_t scene_rev);
    void clear() { waiting_.clear(); }
    bool empty() const { return waiting_.empty(); }
    // The first is being written until end_write().
    Outgoing& begin_write();
    Outgoing end_write();
    bool writing() const { return writing_; }
    // Of messages that wait or are being written.
    std::size_t waiting_bytes() const;
    bool over_bound(std::size_t bytes) const { return bytes > limits_.queued_bytes; }

private:
    const HttpLimits& limits_;
    std::deque<Outgoing> waiting_;
    Outgoing outgoing_{};
    bool writing_ = false;
};

}  // namespace gonio
