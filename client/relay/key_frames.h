// When a receiver that joins, or lost something, gets a picture that it can begin with. Pure.
#pragma once

#include <cstdint>

namespace gonio {

// Key frames are never further apart than `every_ns`, also while nothing moves. Where the last picture was one it is
// sent again, which costs the server nothing; else the server is asked, as a decoder has gone on from it. While there
// is no server the last one is sent again: what follows begins anew.
class KeyFrames {
public:
    enum class Due : std::uint8_t { nothing, ask, repeat };

    explicit KeyFrames(std::uint64_t every_ns) : every_ns_(every_ns) {}

    // A picture was sent, from the server or again.
    void sent(bool key, std::uint64_t now_ns);
    void asked(std::uint64_t now_ns);
    // A receiver asks: heard at most every kLeastNs.
    void wanted() { wanted_ = true; }
    // connected: there is a server that can be asked.
    Due due(std::uint64_t now_ns, bool connected) const;

    static constexpr std::uint64_t kLeastNs = 500'000'000;  // between two that receivers cause

private:
    std::uint64_t every_ns_;
    bool has_key_ = false, is_last_ = false, wanted_ = false, asked_ = false;
    std::uint64_t key_ns_ = 0, asked_ns_ = 0;
};

}  // namespace gonio
