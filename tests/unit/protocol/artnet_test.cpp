// Art-Net: byte vectors, the reply, and the merge of two senders on a clock that the test turns.
#include <gtest/gtest.h>

#include "protocol/dmx/artnet.h"
#include "protocol/dmx/artnet_sources.h"
#include "protocol/schema/console.pb.h"
#include "tests/console/packets.h"
#include "tests/unit/second.h"

namespace gonio {
namespace {

constexpr UdpPeer kDesk{0x0A000001, 6454}, kBackup{0x0A000002, 6454}, kThird{0x0A000003, 6454};

TEST(Artnet, DmxDecodes) {
    const test::Packet bytes = test::art_dmx(9, 0x1234, {1, 2, 3, 4});
    const auto packet = decode_artnet(bytes);
    ASSERT_TRUE(packet) << packet.error().text();
    const auto& dmx = std::get<ArtDmx>(*packet);
    EXPECT_EQ(dmx.sequence, 9);
    EXPECT_EQ(dmx.universe, 0x1234);
    EXPECT_EQ(dmx.slots, 4u);
    EXPECT_EQ(dmx.values[3], 4);
    EXPECT_EQ(dmx.values[4], 0);
}

TEST(Artnet, OtherPacketsAreKnownApart) {
    test::Packet poll = test::art_header(0x2000, 14);
    poll[12] = 2;
    EXPECT_EQ(std::get<ArtPoll>(*decode_artnet(poll)).flags, 2);
    EXPECT_TRUE(std::holds_alternative<ArtSync>(*decode_artnet(test::art_header(0x5200, 14))));
    for (const unsigned opcode : {0x2100u, 0x8000u, 0x9800u})
        EXPECT_EQ(std::get<ArtOther>(*decode_artnet(test::art_header(opcode, 30))).opcode, opcode);
}

TEST(Artnet, WhatIsNoPacketIsRefusedWithItsPlace) {
    const test::Packet good = test::art_dmx(1, 0, {1, 2, 3, 4});
    for (std::size_t length = 0; length < good.size(); ++length)
        EXPECT_FALSE(decode_artnet(Bytes(good).first(length))) << length;
    struct Case {
        std::size_t at;
        std::uint8_t value;
        const char* where;
    };
    for (const Case& c :
         {Case{0, 'a', "byte 0"}, {11, 13, "byte 10"}, {15, 0x80, "byte 14"}, {16, 3, "byte 16"}, {17, 6, "byte 16"}}) {
        test::Packet bytes = good;
        bytes[c.at] = c.value;
        const auto packet = decode_artnet(bytes);
        ASSERT_FALSE(packet) << c.at;
        EXPECT_EQ(packet.error().code, "bad_packet");
        EXPECT_EQ(packet.error().where, c.where);
    }
}

TEST(Artnet, ThePollReplyIsAVisualisersWithItsUniverses) {
    ArtNode node;
    node.ip = {10, 0, 0, 5};
    node.short_name = "Gonio";
    node.long_name = std::string(80, 'g');
    node.universes = {0x0121, 0x0120, 0, 1, 2, 3, 4};
    const auto replies = art_poll_replies(node);
    ASSERT_EQ(replies.size(), 3u) << "0-3, 4, and 0x120-0x121";
    const ArtPollReply& first = replies[0];
    EXPECT_EQ(std::string(first.begin(), first.begin() + 7), "Art-Net");
    EXPECT_EQ(first[8] | first[9] << 8, 0x2100);
    EXPECT_EQ(first[10], 10);
    EXPECT_EQ(first[13], 5);
    EXPECT_EQ(first[14] | first[15] << 8, 6454);
    EXPECT_EQ(std::string(reinterpret_cast<const char*>(&first[26])), "Gonio");
    EXPECT_EQ(std::string(reinterpret_cast<const char*>(&first[44])).size(), 63u);
    EXPECT_EQ(first[173], 4);
    EXPECT_EQ(first[174], 0x80);
    EXPECT_EQ(first[193], 3);
    EXPECT_EQ(first[200], 0x06) << "StVisual";
    EXPECT_EQ(first[211], 1);
    EXPECT_EQ(replies[1][211], 2);
    EXPECT_EQ(replies[2][18], 1) << "net";
    EXPECT_EQ(replies[2][19], 2) << "sub-net";
    EXPECT_EQ(replies[2][173], 2);
    EXPECT_EQ(replies[2][191], 1);
    node.universes.clear();
    ASSERT_EQ(art_poll_replies(node).size(), 1u);
    EXPECT_EQ(art_poll_replies(node)[0][173], 0);
}

TEST(Artnet, ManyUniversesHaveAReplyEachUpToTheNumbersOfReplies) {
    ArtNode node;
    for (unsigned i = 0; i < 100; ++i) node.universes.push_back(static_cast<std::uint16_t>(16 * i));
    const auto replies = art_poll_replies(node);
    ASSERT_EQ(replies.size(), 100u) << "one for each sub-net";
    EXPECT_EQ(replies[99][211], 100);
    EXPECT_EQ(replies[99][18] << 8 | replies[99][19] << 4, 16 * 99);
    for (unsigned i = 100; i < 300; ++i) node.universes.push_back(static_cast<std::uint16_t>(16 * i));
    EXPECT_EQ(art_poll_replies(node).size(), kMaxArtPages) << "BindIndex is one byte";
    EXPECT_EQ(art_poll_replies(node)[254][211], 255);
}

TEST(Artnet, SequencesSkipZeroAndMayBeSwitchedOff) {
    using enum SequenceVerdict;
    EXPECT_EQ(artnet_sequence(255, 1).verdict, accept);
    EXPECT_EQ(artnet_sequence(255, 1).lost, 0u) << "Art-Net counts 1..255";
    EXPECT_EQ(artnet_sequence(255, 3).lost, 2u);
    EXPECT_EQ(artnet_sequence(2, 254).verdict, discard);
    EXPECT_EQ(artnet_sequence(9, 9).verdict, discard);
    EXPECT_EQ(artnet_sequence(0, 9).verdict, accept);
    EXPECT_EQ(artnet_sequence(9, 0).verdict, accept);
}

class Artnets : public testing::Test {
protected:
    bool send(const UdpPeer& from, std::uint8_t value, std::uint8_t sequence = 0, std::uint8_t physical = 0) {
        const auto packet = decode_artnet(test::art_dmx(sequence, 0, {value, 0}, physical));
        EXPECT_TRUE(packet);
        return sources.take(std::get<ArtDmx>(*packet), from, now);
    }
    std::vector<int> levels() {
        std::vector<int> result;
        for (const DmxSource& source : sources.universe(0).sources) result.push_back(source.levels[0]);
        return result;
    }
    void wait(std::int64_t time_ns) {
        now += time_ns;
        sources.tick(now);
    }
    ArtnetSources sources;
    std::int64_t now = 1000 * kSecond;
};

TEST_F(Artnets, TwoMergeAThirdIsRefused) {
    EXPECT_TRUE(send(kDesk, 10));
    EXPECT_TRUE(send(kBackup, 20));
    EXPECT_FALSE(send(kThird, 30));
    EXPECT_EQ(levels(), (std::vector{10, 20}));
    EXPECT_EQ(winning_slots(sources.universe(0)), (std::vector<unsigned>{1, 1}))
        << "slot 1 by its level, slot 2 by order";
}

TEST_F(Artnets, OneAddressWithTwoPhysicalPortsIsTwoSenders) {
    EXPECT_TRUE(send(kDesk, 10, 0, 0));
    EXPECT_TRUE(send(kDesk, 20, 0, 1));
    EXPECT_EQ(levels(), (std::vector{10, 20}));
}

TEST_F(Artnets, ASilentSendersLevelsCountForTenSeconds) {
    send(kDesk, 10);
    send(kBackup, 20);
    wait(9 * kSecond);
    send(kDesk, 11);
    wait(1 * kSecond);
    EXPECT_EQ(levels(), (std::vector{11, 20}));
    wait(1);
    EXPECT_EQ(levels(), (std::vector{11}));
    EXPECT_TRUE(send(kThird, 30)) << "its place in the merge is free";
    EXPECT_FALSE(send(kBackup, 40));
    EXPECT_EQ(levels(), (std::vector{11, 30}));
}

TEST_F(Artnets, AfterArtSyncLevelsWaitForTheNextOneForFourSeconds) {
    send(kDesk, 10);
    EXPECT_EQ(levels(), (std::vector{10}));
    sources.take_sync(kDesk, now);
    send(kDesk, 20);
    EXPECT_EQ(levels(), (std::vector{10}));
    sources.take_sync(kBackup, now);
    EXPECT_EQ(levels(), (std::vector{10})) << "somebody else's ArtSync";
    sources.take_sync(kDesk, now);
    EXPECT_EQ(levels(), (std::vector{20}));
    send(kDesk, 30);
    wait(4 * kSecond + 1);
    EXPECT_EQ(levels(), (std::vector{30})) << "no ArtSync for 4 s";
    send(kDesk, 40);
    EXPECT_EQ(levels(), (std::vector{40}));
}

TEST_F(Artnets, ArtSyncIsIgnoredWhileTwoMerge) {
    send(kDesk, 10);
    send(kBackup, 20);
    sources.take_sync(kDesk, now);
    send(kDesk, 30);
    EXPECT_EQ(levels(), (std::vector{30, 20}));
}

TEST_F(Artnets, APatchedUniverseFindsARowInAFullTable) {
    const auto hear = [&](unsigned universe) {
        const auto packet = decode_artnet(test::art_dmx(0, universe, {1, 0}));
        return sources.take(std::get<ArtDmx>(*packet), kDesk, now);
    };
    for (unsigned i = 0; i < kMaxSourceRows; ++i) EXPECT_TRUE(hear(1000 + i));
    EXPECT_FALSE(hear(5));
    sources.prefer({5});
    EXPECT_TRUE(hear(5));
    EXPECT_EQ(sources.universe(5).sources.size(), 1u);
    EXPECT_FALSE(hear(6));
    wait(11 * kSecond);
    EXPECT_TRUE(hear(6)) << "all are lost: the oldest makes room";
    v1::Sources table;
    sources.describe(table, now);
    EXPECT_EQ(table.sources_size(), static_cast<int>(kMaxSourceRows));
}

// A program that starts anew has another UDP port and is the same sender; two that feed one universe from one machine
// number their ports apart.
TEST_F(Artnets, TheUdpPortIsNoPartOfASender) {
    EXPECT_TRUE(send({kDesk.ip, 40000}, 10));
    EXPECT_TRUE(send({kDesk.ip, 40001}, 20));
    EXPECT_EQ(levels(), (std::vector{20}));
    EXPECT_TRUE(send({kDesk.ip, 40002}, 30, 0, 7));
    v1::Sources table;
    sources.describe(table, now);
    ASSERT_EQ(table.sources_size(), 2);
    EXPECT_EQ(table.sources(0).name(), "");
    EXPECT_EQ(table.sources(1).name(), "physical port 7");
}

TEST_F(Artnets, LatePacketsAreCountedAndNotUsed) {
    send(kDesk, 10, 5);
    send(kDesk, 11, 4);
    send(kDesk, 12, 8);
    EXPECT_EQ(levels(), (std::vector{12}));
    v1::Sources table;
    sources.describe(table, now);
    EXPECT_EQ(table.sources(0).out_of_order(), 1u);
    EXPECT_EQ(table.sources(0).lost(), 2u);
    EXPECT_EQ(table.sources(0).address(), "10.0.0.1:6454");
    EXPECT_EQ(table.sources(0).universe(), 0u);
}

}  // namespace
}  // namespace gonio
