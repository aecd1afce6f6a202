// When a picture is shown, by the clock of the machine that made it. Pure.
#pragma once

#include <cstdint>

namespace gonio {

// Times of pictures, strictly rising. A new picture has the server's own, so that what the network did to it does not
// show. One that is sent again, or comes of another server with another clock, has what has passed here.
class MediaTime {
public:
    // rendered_ns: by the server's clock; now_ns: by this machine's, which never goes back.
    // Result: ns, at least a millisecond after the one before.
    std::uint64_t picture(std::uint64_t rendered_ns, std::uint64_t now_ns);
    // Result: of the picture before, sent once more.
    std::uint64_t again(std::uint64_t now_ns);
    // Result: what a picture made at this moment would have.
    std::uint64_t at(std::uint64_t now_ns) const;

    // A server's clock that is further off than this from what passed here is another server's.
    static constexpr std::uint64_t kJumpNs = 2'000'000'000;

private:
    std::uint64_t say(std::uint64_t media_ns, std::uint64_t now_ns);
    bool begun_ = false;
    std::uint64_t ahead_ns_ = 0;     // what is added to the server's clock; wraps
    std::uint64_t rendered_ns_ = 0;  // of the last new picture
    std::uint64_t media_ns_ = 0, said_at_ns_ = 0;
};

// Result: on RTP's clock of 90 kHz, which wraps.
std::uint32_t rtp_time(std::uint64_t media_ns, std::uint32_t first);

}  // namespace gonio
