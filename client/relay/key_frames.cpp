#include "client/relay/key_frames.h"

namespace gonio {

void KeyFrames::sent(bool key, std::uint64_t now_ns) {
    is_last_ = key;
    if (!key) return;
    has_key_ = true;
    wanted_ = asked_ = false;
    key_ns_ = now_ns;
}

void KeyFrames::asked(std::uint64_t now_ns) {
    asked_ = true;
    asked_ns_ = now_ns;
}

KeyFrames::Due KeyFrames::due(std::uint64_t now_ns, bool connected) const {
    if (!has_key_) return Due::nothing;  // a stream begins with one
    const std::uint64_t since = now_ns - key_ns_;
    if (since < every_ns_ && !(wanted_ && since >= kLeastNs)) return Due::nothing;
    if (is_last_ || !connected) return Due::repeat;
    return asked_ && now_ns - asked_ns_ < kLeastNs ? Due::nothing : Due::ask;
}

}  // namespace gonio
