#include "protocol/dmx/artnet.h"

#include <algorithm>
#include <cstring>

namespace gonio {
namespace {

constexpr std::uint8_t kId[8] = {'A', 'r', 't', '-', 'N', 'e', 't', 0};
constexpr std::uint16_t kOpPoll = 0x2000, kOpPollReply = 0x2100, kOpDmx = 0x5000, kOpSync = 0x5200,
                        kOpTimeCode = 0x9700;
constexpr std::uint16_t kProtocolVersion = 14;
constexpr std::size_t kDmxHeader = 18, kTimeCodeBytes = 19;
constexpr std::uint8_t kStyleVisual = 0x06;
constexpr std::uint8_t kPortOutputsDmx = 0x80;  // PortTypes: DMX512, data from Art-Net
constexpr std::uint8_t kGoodOutputIsTransmitted = 0x80;
constexpr std::uint8_t kStatus2Art4 = 0x08;  // 15-bit port-addresses

void put_text(ArtPollReply& reply, std::size_t at, std::size_t field, const std::string& text) {
    std::copy_n(text.begin(), std::min(text.size(), field - 1), reply.begin() + static_cast<std::ptrdiff_t>(at));
}

ArtPollReply reply_page(const ArtNode& node, std::span<const std::uint16_t> ports, std::size_t index) {
    ArtPollReply reply{};
    std::copy_n(kId, sizeof kId, reply.begin());
    reply[8] = kOpPollReply & 0xFF;
    reply[9] = kOpPollReply >> 8;
    std::copy_n(node.ip.begin(), 4, reply.begin() + 10);
    reply[14] = static_cast<std::uint8_t>(node.port & 0xFF);
    reply[15] = static_cast<std::uint8_t>(node.port >> 8);
    if (!ports.empty()) {
        reply[18] = static_cast<std::uint8_t>(ports[0] >> 8);         // net
        reply[19] = static_cast<std::uint8_t>((ports[0] >> 4) & 15);  // sub-net
    }
    reply[20] = 0x00;  // Oem: 0x00FF, unknown
    reply[21] = 0xFF;
    put_text(reply, 26, 18, node.short_name);
    put_text(reply, 44, 64, node.long_name);
    put_text(reply, 108, 64, node.report);
    reply[173] = static_cast<std::uint8_t>(ports.size());
    for (std::size_t i = 0; i < ports.size(); ++i) {
        reply[174 + i] = kPortOutputsDmx;
        reply[182 + i] = kGoodOutputIsTransmitted;
        reply[190 + i] = static_cast<std::uint8_t>(ports[i] & 15);  // SwOut
    }
    reply[200] = kStyleVisual;
    std::copy_n(node.ip.begin(), 4, reply.begin() + 207);  // BindIp
    reply[211] = static_cast<std::uint8_t>(index);         // BindIndex
    reply[212] = kStatus2Art4;
    return reply;
}

// Frames, seconds, minutes, hours, and the type: film, EBU, drop frame, SMPTE.
Result<ArtPacket> time_code(Bytes packet) {
    if (packet.size() < kTimeCodeBytes)
        return bad_packet(packet.size(), kOpTimeCode, "an ArtTimeCode packet ends too early");
    if (packet[18] > 3) return bad_packet(18, packet[18], "there is no such type of time code");
    const ArtTimeCode time{{{packet[17], packet[16], packet[15], packet[14]}, static_cast<TimecodeRate>(packet[18])}};
    if (!is_timecode(time.timecode)) return bad_packet(14, packet[14], "the time code is none of its type");
    return ArtPacket(time);
}

}  // namespace

Result<ArtPacket> decode_artnet(Bytes packet) {
    if (packet.size() < 10) return bad_packet(packet.size(), 0, "the packet is too short for Art-Net");
    if (std::memcmp(packet.data(), kId, sizeof kId) != 0)
        return bad_packet(0, packet[0], "the packet does not begin with Art-Net");
    const std::uint16_t opcode = le16(packet, 8);
    if (opcode != kOpDmx && opcode != kOpSync && opcode != kOpPoll && opcode != kOpTimeCode)
        return ArtPacket(ArtOther{opcode});
    if (packet.size() < 14) return bad_packet(packet.size(), opcode, "the Art-Net packet ends too early");
    if (be16(packet, 10) < kProtocolVersion) return bad_packet(10, be16(packet, 10), "the Art-Net version is under 14");
    if (opcode == kOpSync) return ArtPacket(ArtSync{});
    if (opcode == kOpPoll) return ArtPacket(ArtPoll{packet[12]});
    if (opcode == kOpTimeCode) return time_code(packet);
    if (packet.size() < kDmxHeader) return bad_packet(packet.size(), 0, "an ArtDmx packet ends too early");
    ArtDmx dmx;
    dmx.sequence = packet[12];
    dmx.physical = packet[13];
    dmx.universe = le16(packet, 14);
    if (dmx.universe > kArtnetMaxUniverse)
        return bad_packet(14, dmx.universe, "the port-address has more than 15 bits");
    dmx.slots = be16(packet, 16);
    if (dmx.slots > kDmxSlots) return bad_packet(16, dmx.slots, "the length is over 512");
    if (kDmxHeader + dmx.slots > packet.size())
        return bad_packet(16, dmx.slots, "the packet ends before its last slot");
    std::copy_n(packet.begin() + kDmxHeader, dmx.slots, dmx.values.begin());
    return ArtPacket(dmx);
}

std::vector<std::vector<std::uint16_t>> art_pages(std::vector<std::uint16_t> universes) {
    std::sort(universes.begin(), universes.end());
    universes.erase(std::unique(universes.begin(), universes.end()), universes.end());
    std::vector<std::vector<std::uint16_t>> pages;
    for (const std::uint16_t universe : universes) {
        if (pages.empty() || pages.back().size() == 4 || pages.back()[0] >> 4 != universe >> 4) pages.emplace_back();
        pages.back().push_back(universe);
    }
    return pages;
}

std::vector<ArtPollReply> art_poll_replies(const ArtNode& node) {
    std::vector<ArtPollReply> replies;
    for (const auto& page : art_pages(node.universes))
        if (replies.size() < kMaxArtPages) replies.push_back(reply_page(node, page, replies.size() + 1));
    if (replies.empty()) replies.push_back(reply_page(node, {}, 1));
    return replies;
}

}  // namespace gonio
