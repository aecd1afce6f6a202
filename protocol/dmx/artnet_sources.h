// Which senders of Art-Net have a say: two of a universe at most, and ArtSync. Pure: packets and the time go in.
// A sender is its IP address and physical port, as Art-Net 4 tells two senders of a merge apart: not its UDP port,
// which programs change when they start anew.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "protocol/dmx/artnet.h"
#include "protocol/dmx/sender_table.h"

namespace gonio {

inline constexpr std::int64_t kArtnetMerge_ns = 10'000'000'000;  // a silent sender's levels count for so long
inline constexpr std::int64_t kArtnetSync_ns = 4'000'000'000;    // without ArtSync for so long: not synchronised
inline constexpr std::size_t kArtnetMergeSources = 2;            // a third sender of a universe is refused

// An IPv4 address in host byte order and a UDP port.
struct UdpPeer {
    std::uint32_t ip = 0;
    std::uint16_t port = 0;
    auto operator<=>(const UdpPeer&) const = default;
};
// Result: "192.168.1.20:5568".
std::string print_peer(const UdpPeer& peer);

struct ArtnetSource : SenderRow {
    std::uint32_t ip = 0;
    std::uint8_t physical = 0;
    UdpPeer peer;
    bool live = true;
    bool is_live() const { return live; }
};

class ArtnetSources : public SenderTable<ArtnetSource> {
public:
    // Result: false where the packet was refused for a bound: a third sender, a full table.
    bool take(const ArtDmx& dmx, const UdpPeer& from, std::int64_t now_ns);
    void take_sync(const UdpPeer& from, std::int64_t now_ns);
    void tick(std::int64_t now_ns);
    DmxUniverse universe(std::uint16_t universe) const;
    void describe(v1::Sources& table, std::int64_t now_ns) const;

private:
    ArtnetSource* source_of(const ArtDmx& dmx, const UdpPeer& from, std::int64_t now_ns);
    bool synchronised(std::uint32_t ip, std::int64_t now_ns) const;

    std::map<std::uint32_t, std::int64_t> syncs_;  // IP -> the last ArtSync; of senders in the table only
};

}  // namespace gonio
