// What the lighting protocols share: slots, universes, and what arbitration leaves of several senders.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <string>
#include <vector>

#include "ies/core/result.h"

namespace gonio {

inline constexpr std::size_t kDmxSlots = 512;
using DmxSlots = std::array<std::uint8_t, kDmxSlots>;  // slot 1 of the standard is element 0

enum class DmxProtocol : std::uint8_t { sacn, artnet };

// Result: "sacn" or "artnet".
const char* dmx_protocol_name(DmxProtocol protocol);

// Result: "bad_packet", of that byte of a packet and what it says.
Error bad_packet(std::size_t byte, std::uint32_t value, std::string message);

// A universe as its protocol counts: sACN 1..63999, Art-Net port-address 0..32767.
struct DmxKey {
    DmxProtocol protocol = DmxProtocol::sacn;
    std::uint16_t universe = 1;
    auto operator<=>(const DmxKey&) const = default;
};

// One sender that has a say in a universe now.
struct DmxSource {
    std::uint32_t id = 0;  // never reused within a process
    DmxSlots levels{};
    DmxSlots rank{};              // per slot, its priority 0..200 plus one; 0: this sender does not control the slot
    std::int64_t changed_ns = 0;  // when its levels last differed from those before
};

// A universe at one moment: whole packets only, so that coarse and fine bytes belong together. Empty: nobody sends.
struct DmxUniverse {
    std::vector<DmxSource> sources;
};

// Result: how many slots each source decides, in the order of `sources`: the highest priority wins a slot, of equals
// the highest level, of those the first.
std::vector<unsigned> winning_slots(const DmxUniverse& universe);

// Packets a second, from the packets of the last whole second or more.
class PacketRate {
public:
    void count(std::int64_t now_ns);
    // Result: 1/s; falls to 0 while nothing comes.
    double per_second(std::int64_t now_ns) const;

private:
    std::int64_t window_ns_ = 0;  // start of the running window
    unsigned packets_ = 0;
    double rate_ = 0.0;
};

// Sequence numbers of one sender in one universe (E1.31 6.7.2; Art-Net counts 1..255 without the 0).
enum class SequenceVerdict { accept, discard };
struct SequenceStep {
    SequenceVerdict verdict = SequenceVerdict::accept;
    unsigned lost = 0;  // packets missing between the last one and this
};
// E1.31: discard where the signed 8-bit difference is in -19..0; a larger step back is a sender that began anew.
SequenceStep sacn_sequence(std::uint8_t last, std::uint8_t now);
// Art-Net: the same window over the circle of 255 numbers; 0 switches the check off.
SequenceStep artnet_sequence(std::uint8_t last, std::uint8_t now);

}  // namespace gonio
