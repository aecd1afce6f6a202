#include "protocol/dmx/e131.h"

#include <algorithm>
#include <cstring>

#include "protocol/text/text_bytes.h"

namespace gonio {
namespace {

constexpr std::uint8_t kPreamble[16] = {0, 0x10, 0, 0, 'A', 'S', 'C', '-', 'E', '1', '.', '1', '7', 0, 0, 0};
constexpr std::uint32_t kRootData = 4, kRootExtended = 8;
constexpr std::uint32_t kFrameData = 2, kExtendedSync = 1, kExtendedDiscovery = 2;
constexpr std::size_t kDataHeader = 126;  // up to slot 1
constexpr std::size_t kSyncPacket = 49, kDiscoveryHeader = 120;
constexpr std::uint8_t kOptionPreview = 0x80, kOptionTerminated = 0x40, kOptionForceSync = 0x20;

// The lengths of the layers must lie inside the packet: flags and length, 0x7 in the upper four bits (E1.31 4.2).
bool layer_fits(Bytes packet, std::size_t at) {
    return packet[at] >> 4 == 7 && (be16(packet, at) & 0x0FFFu) + at <= packet.size();
}

Cid cid_of(Bytes packet) {
    Cid cid;
    std::copy_n(packet.begin() + 22, cid.size(), cid.begin());
    return cid;
}

Result<E131Packet> decode_data(Bytes packet) {
    if (packet.size() < kDataHeader) return bad_packet(packet.size(), 0, "an E1.31 data packet ends too early");
    if (be32(packet, 40) != kFrameData)
        return bad_packet(40, be32(packet, 40), "the E1.31 framing vector is not that of data");
    if (!layer_fits(packet, 38)) return bad_packet(38, be16(packet, 38), "the framing layer is longer than the packet");
    if (!layer_fits(packet, 115)) return bad_packet(115, be16(packet, 115), "the DMP layer is longer than the packet");
    // DMP set property, address and data type, first address 0, increment 1.
    if (packet[117] != 2 || packet[118] != 0xA1 || be16(packet, 119) != 0 || be16(packet, 121) != 1)
        return bad_packet(117, packet[117], "the DMP layer is not that of E1.31");
    E131Data data;
    data.cid = cid_of(packet);
    data.name = printable_text(packet.subspan(44, 63));
    data.priority = packet[108];
    if (data.priority > kE131MaxPriority) return bad_packet(108, data.priority, "the priority is over 200");
    data.sync_address = be16(packet, 109);
    data.sequence = packet[111];
    data.preview = (packet[112] & kOptionPreview) != 0;
    data.terminated = (packet[112] & kOptionTerminated) != 0;
    data.force_sync = (packet[112] & kOptionForceSync) != 0;
    data.universe = be16(packet, 113);
    if (data.universe == 0 || data.universe > kE131MaxUniverse)
        return bad_packet(113, data.universe, "the universe is not one of 1 to 63999");
    const unsigned count = be16(packet, 123);  // start code and slots
    if (count == 0 || count > kDmxSlots + 1) return bad_packet(123, count, "the property count is not one of 1 to 513");
    if (125 + count > packet.size()) return bad_packet(123, count, "the packet ends before its last slot");
    data.start_code = packet[125];
    data.slots = count - 1;
    std::copy_n(packet.begin() + kDataHeader, data.slots, data.values.begin());
    return E131Packet(std::move(data));
}

Result<E131Packet> decode_extended(Bytes packet) {
    if (packet.size() < 44) return bad_packet(packet.size(), 0, "an E1.31 extended packet ends too early");
    if (!layer_fits(packet, 38)) return bad_packet(38, be16(packet, 38), "the framing layer is longer than the packet");
    const std::uint32_t vector = be32(packet, 40);
    if (vector == kExtendedSync) {
        if (packet.size() < kSyncPacket) return bad_packet(packet.size(), 0, "a synchronization packet ends too early");
        E131Sync sync{cid_of(packet), packet[44], be16(packet, 45)};
        if (sync.address == 0 || sync.address > kE131MaxUniverse)
            return bad_packet(45, sync.address, "the synchronization address is not one of 1 to 63999");
        return E131Packet(sync);
    }
    if (vector != kExtendedDiscovery) return bad_packet(40, vector, "the E1.31 extended vector is unknown");
    if (packet.size() < kDiscoveryHeader) return bad_packet(packet.size(), 0, "a discovery packet ends too early");
    if (!layer_fits(packet, 112))
        return bad_packet(112, be16(packet, 112), "the discovery layer is longer than the packet");
    if (be32(packet, 114) != 1)
        return bad_packet(114, be32(packet, 114), "the discovery vector is not a list of universes");
    E131Discovery discovery;
    discovery.cid = cid_of(packet);
    discovery.name = printable_text(packet.subspan(44, 63));
    discovery.page = packet[118];
    discovery.last_page = packet[119];
    if (discovery.page > discovery.last_page)
        return bad_packet(118, discovery.page, "the page lies after the last page");
    const std::size_t end = 112 + (be16(packet, 112) & 0x0FFFu);
    for (std::size_t at = kDiscoveryHeader; at + 2 <= end && discovery.universes.size() < 512; at += 2)
        discovery.universes.push_back(be16(packet, at));
    return E131Packet(std::move(discovery));
}

}  // namespace

Result<E131Packet> decode_e131(Bytes packet) {
    if (packet.size() < 38) return bad_packet(packet.size(), 0, "the packet is too short for E1.31");
    if (std::memcmp(packet.data(), kPreamble, sizeof kPreamble) != 0)
        return bad_packet(0, packet[0], "the packet does not begin with the ACN preamble");
    if (!layer_fits(packet, 16)) return bad_packet(16, be16(packet, 16), "the root layer is longer than the packet");
    const std::uint32_t vector = be32(packet, 18);
    if (vector == kRootData) return decode_data(packet);
    if (vector == kRootExtended) return decode_extended(packet);
    return bad_packet(18, vector, "the root vector is not one of E1.31");
}

}  // namespace gonio
