// H.264 in RTP against the byte layouts of RFC 3550 and 6184, and through a depacketiser of the test's own.
#include "client/relay/rtp.h"

#include <gtest/gtest.h>

#include <optional>
#include <random>

#include "client/relay/sdp.h"
#include "tests/unit/client/relay_bytes.h"

namespace gonio {
namespace {

Buffer unit(int first, std::size_t size) {
    Buffer buffer(size, std::byte{0xAB});
    buffer[0] = static_cast<std::byte>(first);
    return buffer;
}

unsigned at(const Buffer& buffer, std::size_t i) {
    return std::to_integer<unsigned>(buffer.at(i));
}

std::vector<Buffer> packets_of(const std::vector<Buffer>& units, RtpStream stream = {}, std::uint32_t time = 0) {
    return packetise({units.begin(), units.end()}, time, stream);
}

// Written after RFC 6184, 5.6 to 5.8 and 7.1, with nothing of the packetiser's. Result: the units of the picture that
// the packets hold; nothing where a rule is broken.
std::optional<std::vector<Buffer>> depacketised(const std::vector<Buffer>& packets) {
    std::vector<Buffer> units;
    bool open = false;  // a fragmented unit
    for (std::size_t i = 0; i < packets.size(); ++i) {
        const Buffer& packet = packets[i];
        if (packet.size() < 13 || packet.size() > 1200 || at(packet, 0) != 0x80) return std::nullopt;
        const bool marker = (at(packet, 1) & 0x80) != 0, last = i + 1 == packets.size();
        if ((at(packet, 1) & 0x7F) != 96 || marker != last) return std::nullopt;
        const unsigned type = at(packet, 12) & 0x1F;
        if (open && type != 28) return std::nullopt;
        if (type >= 1 && type <= 23) {
            units.emplace_back(packet.begin() + 12, packet.end());
        } else if (type == 24) {
            for (std::size_t begin = 13; begin < packet.size();) {
                if (begin + 2 > packet.size()) return std::nullopt;
                const std::size_t size = at(packet, begin) << 8 | at(packet, begin + 1);
                begin += 2;
                if (size == 0 || begin + size > packet.size()) return std::nullopt;
                units.emplace_back(packet.begin() + static_cast<std::ptrdiff_t>(begin),
                                   packet.begin() + static_cast<std::ptrdiff_t>(begin + size));
                begin += size;
            }
        } else if (type == 28) {
            const unsigned header = at(packet, 13);
            const bool start = (header & 0x80) != 0, end = (header & 0x40) != 0;
            if ((start && end) || (header & 0x20) != 0 || start == open || packet.size() < 15) return std::nullopt;
            if (start) units.push_back({static_cast<std::byte>((at(packet, 12) & 0xE0) | (header & 0x1F))});
            const unsigned first = std::to_integer<unsigned>(units.back()[0]);
            if (((at(packet, 12) & 0xE0) | (header & 0x1F)) != first) return std::nullopt;
            units.back().insert(units.back().end(), packet.begin() + 14, packet.end());
            open = !end;
        } else {
            return std::nullopt;
        }
    }
    return open ? std::nullopt : std::optional(units);
}

TEST(RelayRtp, AUnitThatFitsIsAPacketBehindTheHeaderOfRfc3550) {
    RtpStream stream{0xA0B0C0D0, 0x1234};
    const Buffer slice = bytes({0x41, 0x9A, 0x01});
    const auto packets = packetise({slice}, 0x01020304, stream);
    ASSERT_EQ(packets.size(), 1u);
    EXPECT_EQ(packets[0], bytes({0x80, 0xE0, 0x12, 0x34, 1, 2, 3, 4, 0xA0, 0xB0, 0xC0, 0xD0, 0x41, 0x9A, 0x01}));
    EXPECT_EQ(stream.sequence, 0x1235);
}

TEST(RelayRtp, ParameterSetsShareAStapA) {
    const auto packets =
        packets_of({bytes({0x67, 0x42, 0xC0, 0x1F}), bytes({0x28, 0xCE}), bytes({0x06, 5, 1}), bytes({0x65, 0x88})});
    ASSERT_EQ(packets.size(), 3u);
    const Buffer payload(packets[0].begin() + 12, packets[0].end());
    // F 0, the greatest NRI, type 24; each unit behind its size.
    EXPECT_EQ(payload, bytes({0x78, 0, 4, 0x67, 0x42, 0xC0, 0x1F, 0, 2, 0x28, 0xCE}));
    EXPECT_EQ(at(packets[0], 1), 96u);
    EXPECT_EQ(at(packets[1], 12), 0x06u);
    EXPECT_EQ(at(packets[2], 1), 0x80u | 96u) << "the marker is on the last packet of the picture";
}

TEST(RelayRtp, ParameterSetsThatDoNotFitTogetherGoAlone) {
    const std::vector<Buffer> units = {unit(0x67, 700), unit(0x68, 700), unit(0x68, 300), unit(0x65, 10)};
    const auto packets = packets_of(units);
    ASSERT_EQ(packets.size(), 3u);
    EXPECT_EQ(at(packets[0], 12), 0x67u);
    EXPECT_EQ(at(packets[1], 12) & 31u, 24u);
    EXPECT_EQ(depacketised(packets), units);
}

TEST(RelayRtp, ALongUnitIsCutIntoFuA) {
    const auto packets = packets_of({unit(0x65, 3001)});
    ASSERT_EQ(packets.size(), 3u);
    const std::pair<std::size_t, unsigned> wanted[] = {{1200, 0x85}, {1200, 0x05}, {14 + 3000 - 2 * 1186, 0x45}};
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(packets[i].size(), wanted[i].first);
        EXPECT_EQ(at(packets[i], 12), 0x7Cu) << "NRI of the unit, type 28";
        EXPECT_EQ(at(packets[i], 13), wanted[i].second) << "start, end, and the unit's type";
    }
}

TEST(RelayRtp, TheLongestUnitThatFitsIsNotCut) {
    EXPECT_EQ(packets_of({unit(0x41, 1188)}).size(), 1u);
    const auto cut = packets_of({unit(0x41, 1189)});
    ASSERT_EQ(cut.size(), 2u);
    EXPECT_EQ(cut[1].size(), 14u + 2);
    EXPECT_TRUE(packets_of({}).empty());
    EXPECT_EQ(packets_of({Buffer(), bytes({0x41})}).size(), 1u) << "an empty unit is none";
}

TEST(RelayRtp, WhatIsSentArrives) {
    std::mt19937 random(6184);
    const auto number = [&](unsigned most) { return std::uniform_int_distribution<unsigned>(0, most)(random); };
    RtpStream stream{number(UINT32_MAX), 65'000};  // wraps on the way
    std::uint16_t sequence = stream.sequence;
    for (int picture = 0; picture < 300; ++picture) {
        std::vector<Buffer> units;
        for (unsigned count = 1 + number(5); count > 0; --count) {
            constexpr unsigned kTypes[] = {1, 5, 6, 7, 8, 9};
            const unsigned longest = number(3) == 0 ? 9000 : 1300;
            Buffer one(1 + number(longest));
            for (std::byte& byte : one) byte = static_cast<std::byte>(number(255));
            one[0] = static_cast<std::byte>(number(3) << 5 | kTypes[number(5)]);
            units.push_back(one);
        }
        const std::uint32_t time = number(UINT32_MAX);
        const auto packets = packetise({units.begin(), units.end()}, time, stream);
        EXPECT_EQ(depacketised(packets), units);
        for (const Buffer& packet : packets) {
            EXPECT_EQ(at(packet, 2) << 8 | at(packet, 3), sequence++);
            EXPECT_EQ(at(packet, 4) << 24 | at(packet, 5) << 16 | at(packet, 6) << 8 | at(packet, 7), time);
            EXPECT_EQ(at(packet, 8) << 24 | at(packet, 9) << 16 | at(packet, 10) << 8 | at(packet, 11), stream.ssrc);
        }
    }
    EXPECT_LT(sequence, 65'000) << "the sequence numbers did not wrap";
}

// ------------------------------------------------------------------------------------------------------- NAL units
std::vector<Buffer> units_of(const Buffer& stream) {
    std::vector<Buffer> units;
    for (const ByteSpan one : nal_units(stream)) units.emplace_back(one.begin(), one.end());
    return units;
}

TEST(RelayNalUnits, LieBetweenStartCodesOfThreeOrFourBytes) {
    const std::vector<Buffer> wanted = {bytes({0x67, 0x42}), bytes({0x68, 0xCE}), bytes({0x65, 0, 0, 3, 1, 0x80})};
    EXPECT_EQ(
        units_of(bytes({0, 0, 0, 1, 0x67, 0x42, 0, 0, 1, 0x68, 0xCE, 0, 0, 0, 0, 1, 0x65, 0, 0, 3, 1, 0x80, 0, 0})),
        wanted);
    EXPECT_TRUE(units_of({}).empty());
    EXPECT_TRUE(units_of(bytes({0, 0, 1})).empty());
    EXPECT_TRUE(units_of(bytes({0, 0, 0, 1, 0, 0, 1, 0, 0, 0})).empty());
    EXPECT_TRUE(units_of(bytes({0x67, 0x42, 0, 0})).empty()) << "no start code";
    EXPECT_EQ(annex_b({wanted[0], wanted[1]}), bytes({0, 0, 0, 1, 0x67, 0x42, 0, 0, 0, 1, 0x68, 0xCE}));
}

TEST(RelayNalUnits, AnIdrPictureHasParameterSetsBeforeIt) {
    ParameterSets sets;
    const Buffer sps = bytes({0x67, 0x42}), pps = bytes({0x68, 0xCE}), sei = bytes({6, 1}), idr = bytes({0x65, 1}),
                 other = bytes({0x41, 1}), newer = bytes({0x67, 0x4D});
    const auto sent = [&](const std::vector<Buffer>& units) {
        std::vector<Buffer> result;
        for (const ByteSpan one : with_parameter_sets({units.begin(), units.end()}, sets))
            result.emplace_back(one.begin(), one.end());
        return result;
    };
    using Units = std::vector<Buffer>;
    EXPECT_EQ(sent({idr}), Units{idr}) << "none are known";
    EXPECT_EQ(sent({sps, pps, sei, idr}), (Units{sps, pps, sei, idr}));
    EXPECT_EQ(sent({sei, idr, idr}), (Units{sei, sps, pps, idr, idr})) << "two slices are one picture";
    EXPECT_EQ(sent({other}), Units{other});
    EXPECT_EQ(sent({newer, idr}), (Units{newer, pps, idr}));
    EXPECT_EQ(sent({pps, idr}), (Units{newer, pps, idr}));
}

// ------------------------------------------------------------------------------------------------------------- SDP
TEST(RelaySdp, SaysWhatRfc6184Wants) {
    const ParameterSets sets{bytes({0x67, 0x42, 0xC0, 0x1F}), bytes({0x68, 0xCE})};
    EXPECT_EQ(session_description({"192.0.2.7", 5004, false}, 42, sets),
              "v=0\r\no=- 42 1 IN IP4 192.0.2.7\r\ns=Gonio\r\nc=IN IP4 192.0.2.7\r\nt=0 0\r\n"
              "m=video 5004 RTP/AVPF 96\r\na=rtpmap:96 H264/90000\r\n"
              "a=fmtp:96 packetization-mode=1;profile-level-id=42c01f;sprop-parameter-sets=Z0LAHw==,aM4=\r\n"
              "a=rtcp-fb:96 nack pli\r\na=rtcp-fb:96 ccm fir\r\na=recvonly\r\n");
    const std::string bare = session_description({"::1", 5004, true}, 42, {});
    EXPECT_NE(bare.find("c=IN IP6 ::1\r\n"), std::string::npos);
    EXPECT_NE(bare.find("a=fmtp:96 packetization-mode=1\r\n"), std::string::npos);
    EXPECT_NE(session_description({"239.1.2.3", 5004, false}, 42, sets).find("c=IN IP4 239.1.2.3/1\r\n"),
              std::string::npos);
}

TEST(RelaySdp, Base64IsThatOfRfc4648) {
    const std::pair<const char*, const char*> vectors[] = {{"", ""},
                                                           {"f", "Zg=="},
                                                           {"fo", "Zm8="},
                                                           {"foo", "Zm9v"},
                                                           {"foob", "Zm9vYg=="},
                                                           {"fooba", "Zm9vYmE="},
                                                           {"foobar", "Zm9vYmFy"}};
    for (const auto& [text, coded] : vectors)
        EXPECT_EQ(base64(std::as_bytes(std::span(std::string_view(text)))), coded);
}

}  // namespace
}  // namespace gonio
