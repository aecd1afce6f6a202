// Answers to the messages of clients. Render thread.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "server/session/work.h"

namespace gonio {

inline constexpr std::int64_t kTellNs = 500'000'000;  // so often whoever waits hears of progress

class Replies {
public:
    using Send = std::function<void(std::uint32_t session, v1::ServerMessage)>;
    // scene: results name its revision; it outlives this.
    Replies(Send send, const Scene& scene) : send_(std::move(send)), scene_(scene) {}

    // A message without a request id is not answered.
    void answer(const Work& work, v1::ServerMessage message) const;
    void ok(const Work& work, std::vector<std::string> warnings = {}, std::string replaced = {},
            const std::vector<std::string>& notes = {}) const;
    void refuse(const Work& work, const Error& error);
    void busy(const Work& work, std::string why) { refuse(work, {"busy", "", "", std::move(why)}); }
    const Send& sender() const { return send_; }  // for answers of other threads
    void count_refused() { ++refused_; }
    std::uint32_t refused() const { return refused_; }

private:
    Send send_;
    const Scene& scene_;
    std::uint32_t refused_ = 0;
};

// Result: the answer with this part, e.g. message_of(&v1::ServerMessage::mutable_state, state).
template <typename Part>
v1::ServerMessage message_of(Part* (v1::ServerMessage::*mutable_part)(), Part part) {
    v1::ServerMessage message;
    *(message.*mutable_part)() = std::move(part);
    return message;
}

}  // namespace gonio
