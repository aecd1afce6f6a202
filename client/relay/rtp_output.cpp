#include "client/relay/rtp_output.h"

#include <chrono>
#include <random>
#include <thread>
#include <utility>

#include "client/relay/media_time.h"
#include "client/relay/rtcp.h"

namespace gonio {
namespace {

constexpr std::uint64_t kReportNs = 5'000'000'000;
// 32 packets of 1,200 bytes a millisecond, 300 Mb/s: a socket's usual 208 KiB hold some 90 of them.
constexpr std::size_t kBurstPackets = 32;
constexpr auto kBurstTime = std::chrono::milliseconds(1);
constexpr const char* kCanonicalName = "gonio";

}  // namespace

RtpOutput::RtpOutput(std::unique_ptr<RtpSockets> sockets) : sockets_(std::move(sockets)) {
    std::random_device random;
    stream_.ssrc = random();
    stream_.sequence = static_cast<std::uint16_t>(random());
    first_time_ = random();
}

void RtpOutput::picture(const std::vector<ByteSpan>& units, std::uint64_t media_ns) {
    std::size_t burst = 0;
    for (const auto& packet : packetise(units, rtp_time(media_ns, first_time_), stream_)) {
        if (burst++ == kBurstPackets) {
            std::this_thread::sleep_for(kBurstTime);
            burst = 1;
        }
        if (!sockets_->send(packet)) {
            ++counts_.unsent;
            continue;
        }
        ++counts_.packets;
        counts_.payload_bytes += packet.size() - kRtpHeaderBytes;
    }
}

void RtpOutput::send_report(std::uint64_t media_ns, bool bye) {
    const auto since_1970 = std::chrono::system_clock::now().time_since_epoch();
    const auto unix_ns =
        static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(since_1970).count());
    const SenderState state{stream_.ssrc, ntp_time(unix_ns), rtp_time(media_ns, first_time_),
                            static_cast<std::uint32_t>(counts_.packets),
                            static_cast<std::uint32_t>(counts_.payload_bytes)};
    if (!sockets_->send_report(sender_report(state, kCanonicalName, bye))) ++counts_.unsent;
}

void RtpOutput::report(std::uint64_t media_ns, std::uint64_t now_ns) {
    if (reported_ && now_ns - reported_ns_ < kReportNs) return;
    reported_ = true;
    reported_ns_ = now_ns;
    send_report(media_ns, false);
}

void RtpOutput::leave(std::uint64_t media_ns) {
    send_report(media_ns, true);
}

bool RtpOutput::key_frame_wanted() {
    const std::uint64_t before = counts_.asked;
    sockets_->receive([this](std::span<const std::byte> datagram) {
        if (asks_for_key_frame(datagram, stream_.ssrc)) ++counts_.asked;
    });
    return counts_.asked != before;
}

std::string RtpOutput::description(const ParameterSets& sets) const {
    return session_description(sockets_->to(), stream_.ssrc, sets);
}

}  // namespace gonio
