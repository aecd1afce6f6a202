#include "client/relay/rtcp.h"

#include <algorithm>

#include "client/relay/big_endian.h"

namespace gonio {
namespace {

constexpr unsigned kSenderReport = 200, kSourceDescription = 202, kBye = 203, kPayloadFeedback = 206;
constexpr unsigned kPli = 1, kFir = 4;  // formats of payload-specific feedback
constexpr unsigned kVersion = 2;
constexpr std::byte kCname{1};
constexpr std::size_t kFeedbackBytes = 12, kFirEntryBytes = 8;  // header with both sources; source, number, reserved

// packet: whole, of kFeedbackBytes or more, without padding.
bool feedback_asks(std::span<const std::byte> packet, unsigned format, std::uint32_t ssrc) {
    if (format == kPli) {
        const std::uint32_t media = get_u32(packet, 8);
        return packet.size() == kFeedbackBytes && (media == ssrc || media == 0);
    }
    if (format != kFir || (packet.size() - kFeedbackBytes) % kFirEntryBytes != 0) return false;
    for (std::size_t at = kFeedbackBytes; at < packet.size(); at += kFirEntryBytes)
        if (get_u32(packet, at) == ssrc) return true;
    return false;
}

void put_header(std::vector<std::byte>& to, unsigned count, unsigned type, std::size_t bytes) {
    to.push_back(static_cast<std::byte>(kVersion << 6 | count));
    to.push_back(static_cast<std::byte>(type));
    put_u16(to, static_cast<std::uint16_t>(bytes / 4 - 1));
}

}  // namespace

bool asks_for_key_frame(std::span<const std::byte> datagram, std::uint32_t ssrc) {
    bool asks = false;
    while (!datagram.empty()) {
        if (datagram.size() < 4) return false;
        const unsigned first = std::to_integer<unsigned>(datagram[0]), type = std::to_integer<unsigned>(datagram[1]);
        const std::size_t bytes = (get_u16(datagram, 2) + 1) * 4;
        if (first >> 6 != kVersion || bytes > datagram.size()) return false;
        std::span packet = datagram.first(bytes);
        datagram = datagram.subspan(bytes);
        if ((first & 0x20) != 0) {  // padding, of the last packet alone; its last byte says how much
            const auto padding = std::to_integer<std::size_t>(packet.back());
            if (!datagram.empty() || padding == 0 || padding % 4 != 0 || padding + 4 > packet.size()) return false;
            packet = packet.first(packet.size() - padding);
        }
        if (type == kPayloadFeedback) {
            if (packet.size() < kFeedbackBytes) return false;
            asks = asks || feedback_asks(packet, first & 31u, ssrc);
        }
    }
    return asks;
}

std::vector<std::byte> sender_report(const SenderState& state, std::string_view cname, bool bye) {
    std::vector<std::byte> bytes;
    put_header(bytes, 0, kSenderReport, 28);
    put_u32(bytes, state.ssrc);
    put_u32(bytes, static_cast<std::uint32_t>(state.ntp >> 32));
    put_u32(bytes, static_cast<std::uint32_t>(state.ntp));
    put_u32(bytes, state.rtp_time);
    put_u32(bytes, state.packets);
    put_u32(bytes, state.payload_bytes);

    cname = cname.substr(0, 255);
    const std::size_t chunk = (4 + 2 + cname.size()) / 4 * 4 + 4;  // source, item, and 1 to 4 zeros up to a word's end
    const std::size_t end = bytes.size() + 4 + chunk;
    put_header(bytes, 1, kSourceDescription, 4 + chunk);
    put_u32(bytes, state.ssrc);
    bytes.push_back(kCname);
    bytes.push_back(static_cast<std::byte>(cname.size()));
    std::ranges::transform(cname, std::back_inserter(bytes), [](char c) { return static_cast<std::byte>(c); });
    bytes.resize(end);

    if (bye) {
        put_header(bytes, 1, kBye, 8);
        put_u32(bytes, state.ssrc);
    }
    return bytes;
}

std::uint64_t ntp_time(std::uint64_t unix_ns) {
    constexpr std::uint64_t kSecondsTo1970 = 2'208'988'800, kNs = 1'000'000'000;
    return (unix_ns / kNs + kSecondsTo1970) << 32 | ((unix_ns % kNs) << 32) / kNs;
}

}  // namespace gonio
