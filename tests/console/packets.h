// Packets as senders write them, byte by byte from the standards, apart from the decoders under test.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace gonio::test {

using Packet = std::vector<std::uint8_t>;

inline void put16(Packet& packet, std::size_t at, unsigned value) {
    packet[at] = static_cast<std::uint8_t>(value >> 8);
    packet[at + 1] = static_cast<std::uint8_t>(value);
}

struct SacnPacket {
    std::uint8_t cid = 1;  // all 16 bytes
    std::string name = "sender";
    std::uint8_t priority = 100, sequence = 0, options = 0;
    unsigned sync = 0, universe = 1;
    std::uint8_t start_code = 0;
    std::vector<std::uint8_t> slots;

    Packet bytes() const {
        Packet packet(126 + slots.size(), 0);
        const auto layer = [&](std::size_t at) {
            put16(packet, at, 0x7000u | static_cast<unsigned>(packet.size() - at));
        };
        put16(packet, 0, 0x0010);
        std::memcpy(packet.data() + 4, "ASC-E1.17\0\0\0", 12);
        layer(16);
        packet[21] = 4;
        std::memset(packet.data() + 22, cid, 16);
        layer(38);
        packet[43] = 2;
        std::memcpy(packet.data() + 44, name.data(), name.size());
        packet[108] = priority;
        put16(packet, 109, sync);
        packet[111] = sequence;
        packet[112] = options;
        put16(packet, 113, universe);
        layer(115);
        packet[117] = 2;
        packet[118] = 0xA1;
        put16(packet, 121, 1);
        put16(packet, 123, static_cast<unsigned>(slots.size() + 1));
        packet[125] = start_code;
        if (!slots.empty()) std::memcpy(packet.data() + 126, slots.data(), slots.size());
        return packet;
    }
};

inline Packet sacn_extended(std::uint8_t cid, std::uint8_t vector, std::size_t size) {
    Packet packet = SacnPacket{cid}.bytes();
    packet.assign(packet.begin(), packet.begin() + 38);
    packet.resize(size, 0);
    put16(packet, 16, 0x7000u | static_cast<unsigned>(size - 16));
    packet[21] = 8;
    put16(packet, 38, 0x7000u | static_cast<unsigned>(size - 38));
    packet[43] = vector;
    return packet;
}

inline Packet sacn_sync(std::uint8_t cid, std::uint8_t sequence, unsigned address) {
    Packet packet = sacn_extended(cid, 1, 49);
    packet[44] = sequence;
    put16(packet, 45, address);
    return packet;
}

inline Packet sacn_discovery(std::uint8_t cid, std::uint8_t page, std::uint8_t last,
                             const std::vector<unsigned>& universes) {
    Packet packet = sacn_extended(cid, 2, 120 + 2 * universes.size());
    std::memcpy(packet.data() + 44, "lister", 6);
    put16(packet, 112, 0x7000u | static_cast<unsigned>(packet.size() - 112));
    packet[117] = 1;
    packet[118] = page;
    packet[119] = last;
    for (std::size_t i = 0; i < universes.size(); ++i) put16(packet, 120 + 2 * i, universes[i]);
    return packet;
}

inline Packet art_header(unsigned opcode, std::size_t size) {
    Packet packet(size, 0);
    std::memcpy(packet.data(), "Art-Net", 8);
    packet[8] = static_cast<std::uint8_t>(opcode);
    packet[9] = static_cast<std::uint8_t>(opcode >> 8);
    packet[11] = 14;
    return packet;
}

inline Packet art_dmx(std::uint8_t sequence, unsigned universe, const std::vector<std::uint8_t>& slots,
                      std::uint8_t physical = 0) {
    Packet packet = art_header(0x5000, 18 + slots.size());
    packet[12] = sequence;
    packet[13] = physical;
    packet[14] = static_cast<std::uint8_t>(universe);
    packet[15] = static_cast<std::uint8_t>(universe >> 8);
    put16(packet, 16, static_cast<unsigned>(slots.size()));
    std::memcpy(packet.data() + 18, slots.data(), slots.size());
    return packet;
}

}  // namespace gonio::test
