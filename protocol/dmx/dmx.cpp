#include "protocol/dmx/dmx.h"

namespace gonio {

Error bad_packet(std::size_t byte, std::uint32_t value, std::string message) {
    return {"bad_packet", "byte " + std::to_string(byte), std::to_string(value), std::move(message)};
}
namespace {

constexpr int kLateWindow = 20;  // E1.31 6.7.2
constexpr std::int64_t kSecond_ns = 1'000'000'000;

// step: signed distance from the last accepted number.
SequenceStep judge(int step) {
    if (step <= 0 && step > -kLateWindow) return {SequenceVerdict::discard, 0};
    return {SequenceVerdict::accept, step > 1 ? static_cast<unsigned>(step - 1) : 0u};
}

}  // namespace

const char* dmx_protocol_name(DmxProtocol protocol) {
    return protocol == DmxProtocol::sacn ? "sacn" : "artnet";
}

std::vector<unsigned> winning_slots(const DmxUniverse& universe) {
    std::vector<unsigned> wins(universe.sources.size(), 0);
    for (std::size_t slot = 0; slot < kDmxSlots; ++slot) {
        const DmxSource* best = nullptr;
        std::size_t winner = 0;
        for (std::size_t i = 0; i < universe.sources.size(); ++i) {
            const DmxSource& source = universe.sources[i];
            if (source.rank[slot] == 0) continue;
            const bool better = best == nullptr || source.rank[slot] > best->rank[slot] ||
                                (source.rank[slot] == best->rank[slot] && source.levels[slot] > best->levels[slot]);
            if (!better) continue;
            best = &source;
            winner = i;
        }
        if (best != nullptr) ++wins[winner];
    }
    return wins;
}

void PacketRate::count(std::int64_t now_ns) {
    if (window_ns_ == 0) window_ns_ = now_ns;
    if (now_ns - window_ns_ >= kSecond_ns) {
        rate_ = packets_ * 1e9 / static_cast<double>(now_ns - window_ns_);
        window_ns_ = now_ns;
        packets_ = 0;
    }
    ++packets_;
}

double PacketRate::per_second(std::int64_t now_ns) const {
    const std::int64_t open_ns = now_ns - window_ns_;
    if (window_ns_ == 0) return 0.0;
    // A window that nothing closes tells what comes now.
    return open_ns >= kSecond_ns ? packets_ * 1e9 / static_cast<double>(open_ns) : rate_;
}

SequenceStep sacn_sequence(std::uint8_t last, std::uint8_t now) {
    return judge(static_cast<std::int8_t>(static_cast<std::uint8_t>(now - last)));
}

SequenceStep artnet_sequence(std::uint8_t last, std::uint8_t now) {
    if (last == 0 || now == 0) return {};
    const int step = (now - last + 255) % 255;  // both 1..255
    return judge(step > 127 ? step - 255 : step);
}

}  // namespace gonio
