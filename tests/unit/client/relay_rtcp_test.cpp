// RTCP against the layouts of RFC 3550, 4585 and 5104, what is malformed, the sockets, and when key frames are due.
#include "client/relay/rtcp.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <random>

#include "client/relay/key_frames.h"
#include "client/relay/media_time.h"
#include "client/relay/rtp_output.h"
#include "tests/unit/client/relay_bytes.h"

namespace gonio {
namespace {

Buffer joined(std::initializer_list<Buffer> parts) {
    Buffer whole;
    for (const Buffer& part : parts) whole.insert(whole.end(), part.begin(), part.end());
    return whole;
}

constexpr std::uint32_t kSource = 0xA0B0C0D0;
// An empty receiver report; the name "ab"; PLI and FIR for the source; FIR for another source and then for it.
const Buffer kReport = bytes({0x80, 201, 0, 1, 1, 2, 3, 4});
const Buffer kName = bytes({0x81, 202, 0, 3, 1, 2, 3, 4, 1, 2, 'a', 'b', 0, 0, 0, 0});
const Buffer kPli = bytes({0x81, 206, 0, 2, 1, 2, 3, 4, 0xA0, 0xB0, 0xC0, 0xD0});
const Buffer kFir = bytes({0x84, 206, 0, 4, 1, 2, 3, 4, 0, 0, 0, 0, 0xA0, 0xB0, 0xC0, 0xD0, 7, 0, 0, 0});
const Buffer kTwoFir =
    bytes({0x84, 206, 0, 6, 1, 2, 3, 4, 0, 0, 0, 0, 9, 9, 9, 9, 1, 0, 0, 0, 0xA0, 0xB0, 0xC0, 0xD0, 7, 0, 0, 0});

TEST(RelayRtcp, PliAndFirAskForAKeyFrame) {
    for (const Buffer& asks :
         {kPli, kFir, kTwoFir, joined({kReport, kPli}), joined({kReport, kName, kFir}), joined({kPli, kReport})})
        EXPECT_TRUE(asks_for_key_frame(asks, kSource));
    const Buffer unset = bytes({0x81, 206, 0, 2, 1, 2, 3, 4, 0, 0, 0, 0});
    EXPECT_TRUE(asks_for_key_frame(unset, kSource));
    const Buffer padded = bytes({0xA1, 206, 0, 3, 1, 2, 3, 4, 0xA0, 0xB0, 0xC0, 0xD0, 0, 0, 0, 4});
    EXPECT_TRUE(asks_for_key_frame(padded, kSource));
}

TEST(RelayRtcp, WhatIsForOthersOrOfAnotherKindDoesNot) {
    for (const Buffer& other : {kPli, kFir, kTwoFir}) EXPECT_FALSE(asks_for_key_frame(other, 0x11223344));
    Buffer other = kPli;
    other[0] = std::byte{0x8F};  // REMB and the like
    EXPECT_FALSE(asks_for_key_frame(other, kSource));
    other = kPli;
    other[1] = std::byte{205};  // a NACK: format 1 of transport feedback
    EXPECT_FALSE(asks_for_key_frame(other, kSource));
    EXPECT_FALSE(asks_for_key_frame(joined({kReport, kName}), kSource));
}

TEST(RelayRtcp, MalformedDatagramsAskForNothing) {
    EXPECT_FALSE(asks_for_key_frame({}, kSource));
    for (const Buffer& whole : {kPli, kFir, kTwoFir, joined({kReport, kPli}), joined({kName, kFir})}) {
        for (std::size_t size = 0; size < whole.size(); ++size)
            EXPECT_FALSE(asks_for_key_frame(std::span(whole).first(size), kSource)) << size;
        for (std::size_t more = 1; more < 8; ++more)  // what follows is no packet
            EXPECT_FALSE(asks_for_key_frame(joined({whole, Buffer(more)}), kSource)) << more;
    }
    const Buffer wrong[] = {
        bytes({0x41, 206, 0, 2, 1, 2, 3, 4, 0xA0, 0xB0, 0xC0, 0xD0}),              // version 1
        bytes({0x81, 206, 0, 1, 1, 2, 3, 4}),                                      // no media source
        bytes({0x81, 206, 0, 3, 1, 2, 3, 4, 0xA0, 0xB0, 0xC0, 0xD0, 0, 0, 0, 0}),  // a PLI has nothing behind it
        bytes({0xA1, 206, 0, 2, 1, 2, 3, 4, 0xA0, 0xB0, 0xC0, 0xD0}),              // padding of 208 bytes
        bytes({0xA1, 206, 0, 3, 1, 2, 3, 4, 0xA0, 0xB0, 0xC0, 0xD0, 0, 0, 0, 0}),  // padding of none
        bytes({0x84, 206, 0, 3, 1, 2, 3, 4, 0, 0, 0, 0, 0xA0, 0xB0, 0xC0, 0xD0}),  // half an entry
    };
    for (const Buffer& one : wrong) EXPECT_FALSE(asks_for_key_frame(one, kSource));
}

TEST(RelayRtcp, AnyBytesAreRead) {
    std::mt19937 random(4585);
    int asked = 0;
    for (int i = 0; i < 200'000; ++i) {
        Buffer datagram = i % 2 == 0 ? joined({kReport, kName, kTwoFir}) : Buffer(random() % 80);
        if (i % 2 == 1)
            for (std::byte& byte : datagram) byte = static_cast<std::byte>(random());
        for (unsigned changes = random() % 4; changes > 0 && !datagram.empty(); --changes)
            datagram[random() % datagram.size()] = static_cast<std::byte>(random());
        datagram.resize(std::min(datagram.size(), static_cast<std::size_t>(random() % 100)));
        datagram.shrink_to_fit();  // a sanitizer sees what is read behind it
        asked += asks_for_key_frame(datagram, kSource) ? 1 : 0;
    }
    EXPECT_GT(asked, 1000) << "unchanged ones ask";
    EXPECT_LT(asked, 100'000);
}

TEST(RelayRtcp, TheReportIsThatOfRfc3550) {
    const SenderState state{kSource, 0x1112131421222324, 0x31323334, 0x41424344, 0x51525354};
    const Buffer report = bytes({0x80, 200,  0,    6,    0xA0, 0xB0, 0xC0, 0xD0, 0x11, 0x12, 0x13, 0x14, 0x21, 0x22,
                                 0x23, 0x24, 0x31, 0x32, 0x33, 0x34, 0x41, 0x42, 0x43, 0x44, 0x51, 0x52, 0x53, 0x54});
    // A chunk ends with one to four zeros, at the end of a word.
    EXPECT_EQ(sender_report(state, "ab", false),
              joined({report, bytes({0x81, 202, 0, 3, 0xA0, 0xB0, 0xC0, 0xD0, 1, 2, 'a', 'b', 0, 0, 0, 0})}));
    EXPECT_EQ(sender_report(state, "abc", true),
              joined({report, bytes({0x81, 202, 0, 3, 0xA0, 0xB0, 0xC0, 0xD0, 1, 3, 'a', 'b', 'c', 0, 0, 0}),
                      bytes({0x81, 203, 0, 1, 0xA0, 0xB0, 0xC0, 0xD0})}));
    EXPECT_EQ(sender_report(state, std::string(1000, 'n'), false).size(), 28u + 4 + 4 + 2 + 255 + 3);
    for (std::size_t size = 0; size < 20; ++size)
        EXPECT_FALSE(asks_for_key_frame(sender_report(state, std::string(size, 'n'), true), kSource));
    EXPECT_EQ(ntp_time(0), 0x83AA7E80'00000000u);
    EXPECT_EQ(ntp_time(1'500'000'000), 0x83AA7E81'80000000u);
}

// ------------------------------------------------------------------------------------------------------------ times
constexpr std::uint64_t kMs = 1'000'000, kS = 1'000'000'000;

TEST(RelayMediaTime, IsThePicturesOwnClock) {
    MediaTime time;
    EXPECT_EQ(time.picture(100 * kS, 5 * kS), 100 * kS);
    EXPECT_EQ(time.picture(100 * kS + 33 * kMs, 5 * kS + 90 * kMs), 100 * kS + 33 * kMs) << "late by the network alone";
    EXPECT_EQ(time.picture(100 * kS + 66 * kMs, 5 * kS + 91 * kMs), 100 * kS + 66 * kMs);
}

TEST(RelayMediaTime, GoesOnWhileNothingMoves) {
    MediaTime time;
    time.picture(100 * kS, 5 * kS);
    EXPECT_EQ(time.again(7 * kS), 102 * kS);
    EXPECT_EQ(time.picture(100 * kS, 9 * kS), 104 * kS) << "the same picture, encoded finer";
    EXPECT_EQ(time.at(10 * kS), 105 * kS);
    EXPECT_EQ(time.picture(105 * kS - 10 * kMs, 10 * kS), 105 * kS - 10 * kMs) << "a new one has its own time";
    const std::uint64_t shown = time.again(10 * kS + 30 * kMs);
    EXPECT_GT(time.picture(105 * kS, 10 * kS + 31 * kMs), shown) << "times rise";
}

TEST(RelayMediaTime, AnotherServersClockGoesOnFromHere) {
    MediaTime time;
    time.picture(100 * kS, 5 * kS);
    EXPECT_EQ(time.picture(3 * kS, 8 * kS), 103 * kS);
    EXPECT_EQ(time.picture(3 * kS + 33 * kMs, 8 * kS + 40 * kMs), 103 * kS + 33 * kMs);
    EXPECT_EQ(time.picture(900 * kS, 9 * kS), 104 * kS - 7 * kMs);
}

TEST(RelayMediaTime, OnRtpsClockASecondIs90000) {
    EXPECT_EQ(rtp_time(0, 7), 7u);
    EXPECT_EQ(rtp_time(kS, 7), 90'007u);
    EXPECT_EQ(rtp_time(100 * kMs / 3, 0), 3000u - 1) << "rounded down";
    EXPECT_EQ(rtp_time(47'722 * kS, 0), 90'000u * 47'722 - 0xFFFFFFFFu - 1) << "wraps after 13 hours";
}

// ------------------------------------------------------------------------------------------------------- key frames
TEST(RelayKeyFrames, NothingIsDueBeforeTheFirst) {
    KeyFrames keys(2 * kS);
    keys.wanted();
    EXPECT_EQ(keys.due(100 * kS, true), KeyFrames::Due::nothing);
    EXPECT_EQ(keys.due(100 * kS, false), KeyFrames::Due::nothing);
}

TEST(RelayKeyFrames, AStillOneIsSentAgainWithoutTheServer) {
    KeyFrames keys(2 * kS);
    keys.sent(true, 10 * kS);
    EXPECT_EQ(keys.due(12 * kS - 1, true), KeyFrames::Due::nothing);
    EXPECT_EQ(keys.due(12 * kS, true), KeyFrames::Due::repeat);
    keys.sent(true, 12 * kS);
    EXPECT_EQ(keys.due(13 * kS, true), KeyFrames::Due::nothing);
    EXPECT_EQ(keys.due(14 * kS, true), KeyFrames::Due::repeat);
}

TEST(RelayKeyFrames, AfterOthersTheServerIsAskedAndAskedAgain) {
    KeyFrames keys(2 * kS);
    keys.sent(true, 10 * kS);
    keys.sent(false, 11 * kS);
    EXPECT_EQ(keys.due(12 * kS, true), KeyFrames::Due::ask);
    keys.asked(12 * kS);
    keys.sent(false, 12 * kS + 100 * kMs);
    EXPECT_EQ(keys.due(12 * kS + 499 * kMs, true), KeyFrames::Due::nothing);
    EXPECT_EQ(keys.due(12 * kS + 500 * kMs, true), KeyFrames::Due::ask);
    EXPECT_EQ(keys.due(12 * kS, false), KeyFrames::Due::repeat) << "nobody to ask, and what follows begins anew";
    keys.sent(true, 13 * kS);
    EXPECT_EQ(keys.due(13 * kS + 100 * kMs, true), KeyFrames::Due::nothing);
}

TEST(RelayKeyFrames, ReceiversAreHeardTwiceASecond) {
    KeyFrames keys(60 * kS);
    keys.sent(true, 10 * kS);
    keys.sent(false, 10 * kS + 10 * kMs);
    keys.wanted();
    EXPECT_EQ(keys.due(10 * kS + 499 * kMs, true), KeyFrames::Due::nothing);
    EXPECT_EQ(keys.due(10 * kS + 500 * kMs, true), KeyFrames::Due::ask);
    keys.asked(10 * kS + 500 * kMs);
    keys.sent(true, 10 * kS + 530 * kMs);
    EXPECT_EQ(keys.due(20 * kS, true), KeyFrames::Due::nothing) << "one answers all";
}

// ---------------------------------------------------------------------------------------------------------- sockets
// A receiver on this machine: two ports that follow one another.
struct RelayReceiver : testing::Test {
    int rtp = -1, rtcp = -1;
    std::uint16_t port = 0;
    RelayReceiver() {
        for (int tries = 0; tries < 100 && rtcp < 0; ++tries) {
            if (rtp >= 0) ::close(rtp);
            rtp = bound(0);
            sockaddr_in own{};
            socklen_t size = sizeof own;
            ::getsockname(rtp, reinterpret_cast<sockaddr*>(&own), &size);
            port = ntohs(own.sin_port);
            rtcp = port < 65535 ? bound(static_cast<std::uint16_t>(port + 1)) : -1;
        }
    }
    ~RelayReceiver() override {
        ::close(rtp);
        ::close(rtcp);
    }
    static int bound(std::uint16_t port) {
        const int descriptor = ::socket(AF_INET, SOCK_DGRAM, 0);
        sockaddr_in at{};
        at.sin_family = AF_INET;
        at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        at.sin_port = htons(port);
        if (::bind(descriptor, reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0) return descriptor;
        ::close(descriptor);
        return -1;
    }
    // Result: the next datagram, and where it came from; empty after a second.
    static std::pair<Buffer, sockaddr_in> received(int descriptor) {
        pollfd waited{descriptor, POLLIN, 0};
        sockaddr_in from{};
        socklen_t size = sizeof from;
        Buffer datagram(2000);
        if (::poll(&waited, 1, 1000) != 1) return {};
        const ssize_t got =
            ::recvfrom(descriptor, datagram.data(), datagram.size(), 0, reinterpret_cast<sockaddr*>(&from), &size);
        datagram.resize(static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
        return {datagram, from};
    }
};

TEST_F(RelayReceiver, GetsPicturesAndReportsAndIsHeard) {
    auto sockets = RtpSockets::open("127.0.0.1:" + std::to_string(port), 0);
    ASSERT_TRUE(sockets) << sockets.error().text();
    RtpOutput output(std::move(*sockets));
    const Buffer slice(5000, std::byte{0x41});
    output.picture({slice}, kS);
    std::size_t payload = 0;
    Buffer packet;
    for (int i = 0; i < 5; ++i) {
        packet = received(rtp).first;
        ASSERT_GE(packet.size(), 12u);
        payload += packet.size() - 12;
    }
    EXPECT_EQ(payload, 4999u + 5 * 2);
    EXPECT_EQ(output.counts().packets, 5u);
    EXPECT_EQ(output.counts().payload_bytes, payload);
    EXPECT_EQ(output.counts().unsent, 0u);

    output.report(2 * kS, 2 * kS);
    output.report(3 * kS, 3 * kS);  // not due yet
    const auto [report, from] = received(rtcp);
    ASSERT_EQ(report.size(), 28u + 16);
    EXPECT_TRUE(std::equal(report.begin() + 4, report.begin() + 8, packet.begin() + 8)) << "the packets' source";
    EXPECT_EQ(ntohs(from.sin_port), output.sockets().rtcp_port());

    EXPECT_FALSE(output.key_frame_wanted());
    Buffer pli = bytes({0x81, 206, 0, 2, 1, 2, 3, 4, 0, 0, 0, 0});
    std::copy(packet.begin() + 8, packet.begin() + 12, pli.begin() + 8);
    for (const int socket : {rtcp, rtp}) {  // to either port, as some answer to where the pictures came from
        const int to = socket == rtcp ? output.sockets().rtcp_descriptor() : output.sockets().rtp_descriptor();
        sockaddr_in at{};
        socklen_t size = sizeof at;
        ::getsockname(to, reinterpret_cast<sockaddr*>(&at), &size);
        EXPECT_EQ(ntohl(at.sin_addr.s_addr), INADDR_LOOPBACK) << "nobody else can ask";
        ::sendto(socket, pli.data(), pli.size(), 0, reinterpret_cast<const sockaddr*>(&at), sizeof at);
        pollfd waited{to, POLLIN, 0};
        EXPECT_EQ(::poll(&waited, 1, 1000), 1);
        EXPECT_TRUE(output.key_frame_wanted());
    }
    output.leave(4 * kS);
    EXPECT_EQ(received(rtcp).first.size(), 28u + 16 + 8);
}

TEST_F(RelayReceiver, APacketThatCannotBeSentIsCounted) {
    auto sockets = RtpSockets::open("255.255.255.255:5004", 0);  // broadcast is not allowed to a socket as it is
    ASSERT_TRUE(sockets) << sockets.error().text();
    RtpOutput output(std::move(*sockets));
    const Buffer slice(5000, std::byte{0x41});
    output.picture({slice}, kS);
    EXPECT_EQ(output.counts().packets, 0u);
    EXPECT_EQ(output.counts().unsent, 5u);
}

TEST_F(RelayReceiver, WrongAddressesAreRefused) {
    for (const char* wrong : {"", ":", "127.0.0.1", "127.0.0.1:", ":5004", "127.0.0.1:0", "127.0.0.1:65535",
                              "127.0.0.1:99999", "127.0.0.1:5x", "::1:5004", "[::1]"}) {
        const auto sockets = RtpSockets::open(wrong, 0);
        ASSERT_FALSE(sockets) << wrong;
        EXPECT_EQ(sockets.error().code, "usage");
        EXPECT_EQ(sockets.error().value, wrong);
    }
    const auto taken = RtpSockets::open("127.0.0.1:5004", port);
    ASSERT_FALSE(taken);
    EXPECT_EQ(taken.error().where, "--rtcp");
}

}  // namespace
}  // namespace gonio
