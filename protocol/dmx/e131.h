// ANSI E1.31 (streaming ACN, "sACN") packets -> values. Pure; what they mean together is decided in sacn_sources.h.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "ies/core/result.h"
#include "protocol/dmx/dmx.h"
#include "protocol/text/byte_order.h"

namespace gonio {

inline constexpr std::uint16_t kE131Port = 5568;
inline constexpr std::uint8_t kE131MaxPriority = 200;
inline constexpr std::uint16_t kE131MaxUniverse = 63999;
inline constexpr std::uint16_t kE131DiscoveryUniverse = 64214;
inline constexpr std::size_t kMaxJoinedUniverses = 512;  // multicast groups of patched universes; more: unicast only
inline constexpr std::size_t kE131MaxPacket = 1144;      // a full page of universe discovery; data packets end at 638

using Cid = std::array<std::uint8_t, 16>;

// Start codes that matter here; others are handed on and ignored.
inline constexpr std::uint8_t kStartCodeLevels = 0x00;
inline constexpr std::uint8_t kStartCodePriorities = 0xDD;

struct E131Data {
    Cid cid{};
    std::string name;                // UTF-8, at most 63 bytes; other bytes are replaced by '?'
    std::uint8_t priority = 100;     // 0..200
    std::uint16_t sync_address = 0;  // universe of the synchronization packets; 0: none
    std::uint8_t sequence = 0;
    bool preview = false, terminated = false, force_sync = false;
    std::uint16_t universe = 1;  // 1..63999
    std::uint8_t start_code = 0;
    unsigned slots = 0;  // 0..512 that the packet holds; the others are 0
    DmxSlots values{};
};

struct E131Sync {
    Cid cid{};
    std::uint8_t sequence = 0;
    std::uint16_t address = 0;
};

struct E131Discovery {
    Cid cid{};
    std::string name;
    std::uint8_t page = 0, last_page = 0;
    std::vector<std::uint16_t> universes;  // at most 512
};

using E131Packet = std::variant<E131Data, E131Sync, E131Discovery>;

// Errors: "bad_packet" with the byte offset as place.
Result<E131Packet> decode_e131(Bytes packet);

// Result: the IPv4 multicast group of a universe, 239.255.hi.lo, in host byte order.
inline std::uint32_t e131_group(std::uint16_t universe) {
    return 0xEFFF0000u | universe;
}

}  // namespace gonio
