// Art-Net 4 packets -> values, and the reply that makes consoles send to a visualiser. Pure.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "ies/core/result.h"
#include "protocol/dmx/dmx.h"
#include "protocol/text/byte_order.h"
#include "protocol/timecode/timecode.h"

namespace gonio {

inline constexpr std::uint16_t kArtnetPort = 6454;
inline constexpr std::uint16_t kArtnetMaxUniverse = 0x7FFF;  // port-address: net 7 bits, sub-net 4, universe 4
inline constexpr std::size_t kArtnetMaxPacket = 530;         // ArtDmx with 512 slots

struct ArtDmx {
    std::uint8_t sequence = 0;  // 0: the sender does not number its packets
    std::uint8_t physical = 0;
    std::uint16_t universe = 0;  // port-address 0..32767
    unsigned slots = 0;          // 0..512
    DmxSlots values{};
};
struct ArtSync {};
struct ArtPoll {
    std::uint8_t flags = 0;
};
struct ArtTimeCode {
    Timecode timecode;
};
struct ArtOther {
    std::uint16_t opcode = 0;  // well-formed, and none of a receiver's business (replies of others, RDM)
};
using ArtPacket = std::variant<ArtDmx, ArtSync, ArtPoll, ArtTimeCode, ArtOther>;

// Errors: "bad_packet" with the byte offset as place.
Result<ArtPacket> decode_artnet(Bytes packet);

inline constexpr std::size_t kArtPollReplyBytes = 239;
using ArtPollReply = std::array<std::uint8_t, kArtPollReplyBytes>;

// What is told about us.
struct ArtNode {
    std::array<std::uint8_t, 4> ip{};
    std::uint16_t port = kArtnetPort;
    std::string short_name, long_name;     // cut at 17 and 63 bytes
    std::string report;                    // "#0001 [0000] …", cut at 63 bytes
    std::vector<std::uint16_t> universes;  // that we listen to; a reply holds four of one net and sub-net
};

inline constexpr std::size_t kMaxArtPages = 255;  // BindIndex has one byte; universes beyond are told to nobody

// Result: how the universes, sorted and each once, go onto pages of four of one sub-net; there may be more pages than
// replies.
std::vector<std::vector<std::uint16_t>> art_pages(std::vector<std::uint16_t> universes);
// Result: the replies to one ArtPoll, at least one, at most kMaxArtPages: style "visualiser" (0x06), one for each page,
// numbered by BindIndex from 1.
std::vector<ArtPollReply> art_poll_replies(const ArtNode& node);

}  // namespace gonio
