// sACN: byte vectors of each packet, and each rule of arbitration on a clock that the test turns.
#include <gtest/gtest.h>

#include "protocol/dmx/e131.h"
#include "protocol/dmx/sacn_sources.h"
#include "protocol/schema/console.pb.h"
#include "tests/console/packets.h"

namespace gonio {
namespace {

using test::SacnPacket;

constexpr std::int64_t kMs = 1'000'000;

TEST(E131, ADataPacketOfOlaDecodes) {
    // Six slots in 132 bytes, as OLA sends them: preamble, root, framing, DMP.
    const SacnPacket sent{0xAB, "OLA", 120, 7, 0, 0, 258, 0, {255, 128, 64, 1, 2, 3}};
    const test::Packet bytes = sent.bytes();
    ASSERT_EQ(bytes.size(), 132u);
    const auto packet = decode_e131(bytes);
    ASSERT_TRUE(packet) << packet.error().text();
    const auto& data = std::get<E131Data>(*packet);
    EXPECT_EQ(data.cid[0], 0xAB);
    EXPECT_EQ(data.name, "OLA");
    EXPECT_EQ(data.priority, 120);
    EXPECT_EQ(data.sequence, 7);
    EXPECT_EQ(data.universe, 258);
    EXPECT_EQ(data.slots, 6u);
    EXPECT_EQ(data.values[0], 255);
    EXPECT_EQ(data.values[5], 3);
    EXPECT_EQ(data.values[6], 0);
    EXPECT_FALSE(data.preview || data.terminated || data.force_sync);
}

TEST(E131, OptionsSynchronizationAndTerminationWithoutSlots) {
    SacnPacket sent;
    sent.options = 0x80 | 0x40 | 0x20;
    sent.sync = 0x1234;
    const test::Packet bytes = sent.bytes();
    ASSERT_EQ(bytes.size(), 126u) << "property count 1: the start code alone";
    const auto packet = decode_e131(bytes);
    ASSERT_TRUE(packet);
    const auto& data = std::get<E131Data>(*packet);
    EXPECT_TRUE(data.preview && data.terminated && data.force_sync);
    EXPECT_EQ(data.sync_address, 0x1234);
    EXPECT_EQ(data.slots, 0u);
}

TEST(E131, SyncAndDiscoveryDecode) {
    const auto sync = decode_e131(test::sacn_sync(3, 9, 7000));
    ASSERT_TRUE(sync) << sync.error().text();
    EXPECT_EQ(std::get<E131Sync>(*sync).sequence, 9);
    EXPECT_EQ(std::get<E131Sync>(*sync).address, 7000);
    const auto discovery = decode_e131(test::sacn_discovery(3, 0, 1, {1, 2, 300}));
    ASSERT_TRUE(discovery) << discovery.error().text();
    EXPECT_EQ(std::get<E131Discovery>(*discovery).universes, (std::vector<std::uint16_t>{1, 2, 300}));
    EXPECT_EQ(std::get<E131Discovery>(*discovery).name, "lister");
}

TEST(E131, WhatIsNoPacketIsRefusedWithItsPlace) {
    const test::Packet good = SacnPacket{1, "x", 100, 0, 0, 0, 1, 0, {1, 2, 3}}.bytes();
    for (std::size_t length = 0; length < good.size(); ++length)
        EXPECT_FALSE(decode_e131(Bytes(good).first(length))) << length;
    struct Case {
        std::size_t at;
        std::uint8_t value;
        const char* where;
    };
    for (const Case& c : {Case{0, 1, "byte 0"},
                          {4, 'X', "byte 0"},
                          {21, 5, "byte 18"},
                          {43, 9, "byte 40"},
                          {108, 201, "byte 108"},
                          {117, 1, "byte 117"},
                          {118, 0xA2, "byte 117"},
                          {124, 0, "byte 123"},
                          {124, 200, "byte 123"},
                          {16, 0x7F, "byte 16"},
                          {38, 0x60, "byte 38"},
                          {115, 0x7F, "byte 115"}}) {
        test::Packet bytes = good;
        bytes[c.at] = c.value;
        const auto packet = decode_e131(bytes);
        ASSERT_FALSE(packet) << c.at;
        EXPECT_EQ(packet.error().code, "bad_packet");
        EXPECT_EQ(packet.error().where, c.where);
    }
    test::Packet universe = good;
    test::put16(universe, 113, 0);
    EXPECT_FALSE(decode_e131(universe));
    test::put16(universe, 113, 64000);
    EXPECT_FALSE(decode_e131(universe));
}

TEST(E131, ANameOfAnyBytesIsText) {
    SacnPacket sent;
    sent.name = "a\xff\x01\xc3\xa9";
    const auto packet = decode_e131(sent.bytes());
    ASSERT_TRUE(packet);
    EXPECT_EQ(std::get<E131Data>(*packet).name, "a??\xc3\xa9");
}

// Signed 8-bit steps: E1.31 6.7.2.
TEST(E131, TheSequenceWindowIsSigned8Bit) {
    using enum SequenceVerdict;
    EXPECT_EQ(sacn_sequence(10, 11).verdict, accept);
    EXPECT_EQ(sacn_sequence(10, 10).verdict, discard) << "repeated";
    EXPECT_EQ(sacn_sequence(10, 9).verdict, discard) << "late";
    EXPECT_EQ(sacn_sequence(255, 0).verdict, accept) << "wrap";
    EXPECT_EQ(sacn_sequence(255, 0).lost, 0u);
    EXPECT_EQ(sacn_sequence(3, 250).verdict, discard) << "9 late across the wrap: int, not int8, would take it";
    EXPECT_EQ(sacn_sequence(100, 81).verdict, discard) << "19 late";
    EXPECT_EQ(sacn_sequence(100, 80).verdict, accept) << "20 back: the sender began anew";
    EXPECT_EQ(sacn_sequence(100, 80).lost, 0u);
    EXPECT_EQ(sacn_sequence(250, 4).lost, 9u);
}

// A receiver and the clock before it.
class Sacn : public testing::Test {
protected:
    // Each sender numbers its own packets in each universe.
    void send(SacnPacket packet) {
        packet.sequence = sequences_[{packet.cid, packet.universe}]++;
        send_raw(packet.bytes());
    }
    void send_raw(const test::Packet& bytes) {
        const auto packet = decode_e131(bytes);
        ASSERT_TRUE(packet) << packet.error().text();
        EXPECT_TRUE(sources.take(*packet, "10.0.0.1:5568", now));
    }
    void wait(std::int64_t time_ns) {
        const std::int64_t end = now + time_ns;
        while (now < end) {
            now = std::min(end, now + 100 * kMs);
            sources.tick(now);
        }
    }
    // Sends it again every 500 ms for so long.
    void keep_sending(const std::vector<SacnPacket>& packets, std::int64_t time_ns) {
        for (std::int64_t end = now + time_ns; now < end;) {
            for (const SacnPacket& packet : packets) send(packet);
            wait(500 * kMs);
        }
    }
    std::vector<int> levels(std::uint16_t universe = 1) {
        std::vector<int> result;
        for (const DmxSource& source : sources.universe(universe).sources) result.push_back(source.levels[0]);
        return result;
    }
    v1::SourceRow row(std::size_t index = 0) {
        v1::Sources table;
        sources.describe(table, now);
        return table.sources(static_cast<int>(index));
    }
    SacnSources sources;
    std::int64_t now = 1'000'000'000'000;

private:
    std::map<std::pair<int, unsigned>, std::uint8_t> sequences_;
};

SacnPacket level(std::uint8_t cid, std::uint8_t value, std::uint8_t priority = 100) {
    SacnPacket packet;
    packet.cid = cid;
    packet.name = "sender " + std::to_string(cid);
    packet.priority = priority;
    packet.slots = {value, 0, 0, 0};
    return packet;
}
SacnPacket priorities(std::uint8_t cid, std::vector<std::uint8_t> values) {
    SacnPacket packet = level(cid, 0);
    packet.start_code = 0xDD;
    packet.slots = std::move(values);
    return packet;
}

TEST_F(Sacn, ANewSenderWaitsForItsPrioritiesAtMostOneAndAHalfSeconds) {
    send(level(1, 50));
    EXPECT_TRUE(levels().empty());
    EXPECT_EQ(row().state(), "waiting");
    wait(1499 * kMs);
    EXPECT_TRUE(levels().empty());
    wait(1 * kMs);
    EXPECT_EQ(levels(), (std::vector{50}));
    EXPECT_EQ(row().state(), "live");
    EXPECT_EQ(sources.take_changed(), (std::vector<std::uint16_t>{1}));
}

TEST_F(Sacn, WithItsPrioritiesASenderIsHeardAtOnce) {
    send(level(1, 50));
    send(priorities(1, {100, 0}));
    ASSERT_EQ(levels(), (std::vector{50}));
    const DmxUniverse universe = sources.universe(1);
    EXPECT_EQ(universe.sources[0].rank[0], 101);
    EXPECT_EQ(universe.sources[0].rank[1], 0) << "0: not controlled";
    EXPECT_EQ(universe.sources[0].rank[2], 0) << "missing slots are 0";
    EXPECT_EQ(winning_slots(universe), (std::vector<unsigned>{1}));
}

TEST_F(Sacn, PrioritiesThatArriveLateCountFromThen) {
    keep_sending({level(1, 50, 90)}, 2000 * kMs);
    EXPECT_EQ(sources.universe(1).sources.at(0).rank[1], 91);
    send(priorities(1, {255, 0, 0, 0}));  // over 200: reserved, the highest
    EXPECT_EQ(sources.universe(1).sources.at(0).rank[0], 201);
    EXPECT_EQ(sources.universe(1).sources.at(0).rank[1], 0);
    // and when they stop while the levels go on, the priority of the universe counts again.
    keep_sending({level(1, 50, 90)}, 3000 * kMs);
    EXPECT_EQ(sources.universe(1).sources.at(0).rank[1], 91);
}

TEST_F(Sacn, SlotsThatAShortPacketLacksAreNotControlled) {
    send(level(1, 50));
    wait(1500 * kMs);
    EXPECT_EQ(sources.universe(1).sources.at(0).rank[3], 101);
    EXPECT_EQ(sources.universe(1).sources.at(0).rank[4], 0);
}

TEST_F(Sacn, AHigherPriorityWinsAndOfEqualsTheHigherLevel) {
    for (const auto& packet : {level(1, 200, 100), level(2, 10, 150), level(3, 20, 150)}) send(packet);
    wait(1500 * kMs);
    EXPECT_EQ(winning_slots(sources.universe(1)), (std::vector<unsigned>{0, 3, 1}))
        << "level 20 in slot 1; ties go to the first";
}

TEST_F(Sacn, ASenderMayBeginWithAnySequenceNumber) {
    std::uint8_t cid = 0;
    for (const std::uint8_t sequence : {0, 1, 127, 128, 236, 250, 255}) {
        SacnPacket packet = level(++cid, 255);
        packet.universe = cid;
        packet.sequence = sequence;
        send_raw(packet.bytes());
    }
    wait(1500 * kMs);
    for (std::uint8_t universe = 1; universe <= cid; ++universe) EXPECT_EQ(levels(universe), (std::vector{255}));
}

TEST_F(Sacn, SequencesArePerSenderAndUniverse) {
    for (const unsigned universe : {1u, 2u}) {
        for (const std::uint8_t cid : {1, 2}) {
            SacnPacket packet = level(cid, 9);
            packet.universe = universe;
            packet.sequence = 5;
            send_raw(packet.bytes());
        }
    }
    v1::Sources table;
    sources.describe(table, now);
    ASSERT_EQ(table.sources_size(), 4);
    for (const v1::SourceRow& one : table.sources()) EXPECT_EQ(one.out_of_order(), 0u);
}

TEST_F(Sacn, LateAndLostPacketsAreCounted) {
    SacnPacket packet = level(1, 10);
    for (const int sequence : {250, 251, 254, 253, 0}) {
        packet.sequence = static_cast<std::uint8_t>(sequence);
        packet.slots[0] = static_cast<std::uint8_t>(sequence);
        send_raw(packet.bytes());
    }
    EXPECT_EQ(row().out_of_order(), 1u);
    EXPECT_EQ(row().lost(), 2u + 1u);
    EXPECT_EQ(row().packets(), 5u);
    packet.sequence = 254;  // two late across the wrap
    packet.slots[0] = 77;
    send_raw(packet.bytes());
    wait(1500 * kMs);
    EXPECT_EQ(levels(), (std::vector{0})) << "the late packet's level was not used";
}

TEST_F(Sacn, SilenceForTwoAndAHalfSecondsIsALoss) {
    send(level(1, 50));
    wait(2500 * kMs);
    EXPECT_EQ(levels(), (std::vector{50}));
    wait(100 * kMs);
    EXPECT_TRUE(levels().empty());
    EXPECT_EQ(row().state(), "lost");
    // It may come back, with any sequence number.
    SacnPacket packet = level(1, 60);
    packet.sequence = 200;
    send_raw(packet.bytes());
    wait(1500 * kMs);
    EXPECT_EQ(levels(), (std::vector{60}));
}

TEST_F(Sacn, WhenACableIsPulledNobodyTakesOverBetweenTwoTimers) {
    keep_sending({level(1, 200, 150), level(2, 10, 100)}, 2000 * kMs);
    send(level(1, 200, 150));
    wait(400 * kMs);
    send(level(2, 10, 100));  // the last packet of all
    for (int i = 0; i < 40; ++i) {
        wait(100 * kMs);
        const DmxUniverse universe = sources.universe(1);
        if (universe.sources.empty()) break;
        EXPECT_EQ(winning_slots(universe)[0], 4u) << "at " << i;
    }
    EXPECT_TRUE(levels().empty());
}

TEST_F(Sacn, ALowerPriorityTakesOverWhenItIsHeardAfterTheLoss) {
    keep_sending({level(1, 200, 150), level(2, 10, 100)}, 2000 * kMs);
    keep_sending({level(2, 10, 100)}, 3500 * kMs);
    EXPECT_EQ(levels(), (std::vector{10}));
}

TEST_F(Sacn, TerminationTakesEffectAtOnceAlsoWithoutSlots) {
    send(level(1, 50));
    send(level(2, 60));
    wait(1500 * kMs);
    SacnPacket end = level(1, 0);
    end.options = 0x40;
    end.slots.clear();
    for (int i = 0; i < 3; ++i) send(end);
    EXPECT_EQ(levels(), (std::vector{60}));
    EXPECT_EQ(row().state(), "terminated");
    // One that begins again afterwards is heard.
    send(level(1, 70));
    wait(1500 * kMs);
    EXPECT_EQ(levels(), (std::vector{70, 60}));
}

TEST_F(Sacn, SynchronizedLevelsWaitForTheirSyncPacket) {
    sources.prefer({1});
    SacnPacket packet = level(1, 10);
    packet.sync = 900;
    send(packet);
    EXPECT_EQ(sources.sync_addresses(), (std::set<std::uint16_t>{900}));
    send_raw(test::sacn_sync(1, 1, 900));
    wait(1500 * kMs);
    EXPECT_EQ(levels(), (std::vector{10}));
    packet.slots[0] = 20;
    send(packet);
    EXPECT_EQ(levels(), (std::vector{10}));
    send_raw(test::sacn_sync(1, 2, 901));
    EXPECT_EQ(levels(), (std::vector{10})) << "another address";
    send_raw(test::sacn_sync(1, 1, 900));
    EXPECT_EQ(levels(), (std::vector{10})) << "a repeated sync packet";
    send_raw(test::sacn_sync(1, 2, 900));
    EXPECT_EQ(levels(), (std::vector{20}));
}

TEST_F(Sacn, WithoutSyncPacketsForceSynchronizationLetsLevelsCountAgain) {
    for (const bool force : {false, true}) {
        SacnPacket packet = level(force ? 2 : 1, 10);
        packet.universe = force ? 2 : 1;
        packet.sync = 900;
        packet.options = force ? 0x20 : 0;
        send(packet);
        send_raw(test::sacn_sync(packet.cid, 1, 900));
        keep_sending({packet}, 1500 * kMs);
        packet.slots[0] = 20;
        keep_sending({packet}, 4000 * kMs);
        EXPECT_EQ(levels(static_cast<std::uint16_t>(packet.universe)), (std::vector{force ? 20 : 10}))
            << "Force_Synchronization clear: nothing moves until synchronization resumes";
    }
}

TEST_F(Sacn, ThePreviewBitIsHeardUnlessSwitchedOff) {
    SacnPacket packet = level(1, 50);
    packet.options = 0x80;
    send(packet);
    wait(1500 * kMs);
    EXPECT_EQ(levels(), (std::vector{50}));
    EXPECT_TRUE(row().preview());
    SacnSources deaf(false);
    deaf.take(*decode_e131(packet.bytes()), "x", now);
    v1::Sources table;
    deaf.describe(table, now);
    EXPECT_EQ(table.sources_size(), 0);
}

TEST_F(Sacn, OtherStartCodesAreNoLevels) {
    send(level(1, 50));
    wait(1500 * kMs);
    SacnPacket text = level(1, 99);
    text.start_code = 0x17;
    send(text);
    EXPECT_EQ(levels(), (std::vector{50}));
}

TEST_F(Sacn, DiscoveryListsUniversesOverSeveralPagesAndForgetsThem) {
    send_raw(test::sacn_discovery(1, 0, 1, {1, 2}));
    v1::Sources table;
    sources.describe(table, now);
    EXPECT_EQ(table.discovered(0).universes_size(), 0) << "the second page is missing";
    send_raw(test::sacn_discovery(1, 1, 1, {7}));
    table.Clear();
    sources.describe(table, now);
    ASSERT_EQ(table.discovered(0).universes_size(), 3);
    EXPECT_EQ(table.discovered(0).universes(2), 7u);
    wait(26'000 * kMs);
    table.Clear();
    sources.describe(table, now);
    EXPECT_EQ(table.discovered_size(), 0);
}

TEST_F(Sacn, TheTableSaysWhatArrives) {
    for (int i = 0; i < 88; ++i) {
        send(level(1, 50, 120));
        wait(25 * kMs);
    }
    const v1::SourceRow one = row();
    EXPECT_EQ(one.protocol(), "sacn");
    EXPECT_EQ(one.universe(), 1u);
    EXPECT_EQ(one.name(), "sender 1");
    EXPECT_EQ(one.address(), "10.0.0.1:5568");
    EXPECT_EQ(one.cid(), "01010101010101010101010101010101");
    EXPECT_EQ(one.priority(), 120u);
    EXPECT_NEAR(one.rate_hz(), 40.0, 1.0);
    EXPECT_EQ(one.packets(), 88u);
    EXPECT_EQ(one.slots(), 4u);
    ASSERT_EQ(one.levels_size(), 1) << "zeros at the end are left out";
    EXPECT_EQ(one.levels(0), 50u);
    EXPECT_EQ(one.winning_slots(), 4u);
    wait(5000 * kMs);
    EXPECT_NEAR(row().rate_hz(), 0.0, 10.0);
    EXPECT_GT(row().age_s(), 4.9);
}

TEST_F(Sacn, SendersAndUniversesAreBounded) {
    for (unsigned cid = 0; cid < kMaxUniverseSources; ++cid) send(level(static_cast<std::uint8_t>(cid), 1));
    EXPECT_FALSE(sources.take(*decode_e131(level(99, 1).bytes()), "x", now));
    wait(3000 * kMs);  // all are lost; then a newcomer takes a row
    EXPECT_TRUE(sources.take(*decode_e131(level(99, 1).bytes()), "x", now));
}

TEST_F(Sacn, APriorityOfZeroIsTheLowestAndStillCounts) {
    for (const auto& packet : {level(1, 200, 0), level(2, 10, 1)}) send(packet);
    wait(1500 * kMs);
    EXPECT_EQ(winning_slots(sources.universe(1)), (std::vector<unsigned>{0, 4})) << "1 is higher than 0";
    SacnPacket end = level(2, 0);
    end.options = 0x40;
    send(end);
    EXPECT_EQ(winning_slots(sources.universe(1)), (std::vector<unsigned>{4})) << "0 alone controls its slots";
}

// A full table: 1,024 senders of foreign universes, all live.
class FullTable : public Sacn {
protected:
    bool hear(unsigned universe, std::uint8_t cid = 1) {
        SacnPacket packet = level(cid, 1);
        packet.universe = universe;
        packet.sequence = sequence++;
        return sources.take(*decode_e131(packet.bytes()), "x", now);
    }
    void SetUp() override {
        for (unsigned i = 0; i < kMaxSourceRows; ++i) EXPECT_TRUE(hear(1000 + i));
        sequence += 2;  // the next round counts on
    }
    int rows() {
        v1::Sources table;
        sources.describe(table, now);
        return table.sources_size();
    }
    std::uint8_t sequence = 0;
};

TEST_F(FullTable, IsFullForForeignUniversesOnly) {
    EXPECT_FALSE(hear(5)) << "nobody patched it";
    sources.prefer({5, 6});
    EXPECT_TRUE(hear(5));
    EXPECT_TRUE(hear(5, 2));
    EXPECT_TRUE(hear(6));
    EXPECT_EQ(rows(), static_cast<int>(kMaxSourceRows));
    wait(1500 * kMs);
    EXPECT_EQ(levels(5), (std::vector{1, 1}));
    EXPECT_FALSE(hear(7)) << "still nobody's";
}

TEST_F(FullTable, RowsOfLostSendersGoFirst) {
    now += 1000 * kMs;
    for (unsigned i = 1; i < kMaxSourceRows; ++i) hear(1000 + i);  // the first one is silent
    wait(1600 * kMs);
    EXPECT_TRUE(hear(5)) << "a newcomer takes the row of a lost sender at once, not after 60 s";
    EXPECT_TRUE(sources.universe(1000).sources.empty());
    EXPECT_FALSE(hear(8));
    sources.prefer({5});
    wait(3000 * kMs);  // all are lost, 5 too
    EXPECT_TRUE(hear(8));
    EXPECT_EQ(rows(), static_cast<int>(kMaxSourceRows));
    v1::Sources table;
    sources.describe(table, now);
    EXPECT_EQ(table.sources(0).universe(), 5u) << "a lost sender of a patched universe stays to be seen";
}

TEST_F(FullTable, IsSentInTwoMegabytes) {
    v1::Sources table;
    sources.describe(table, now);
    EXPECT_LT(table.ByteSizeLong(), 2u << 20);
}

// What foreign packets name is never joined; what senders in patched universes name, up to a bound.
TEST_F(Sacn, SynchronizationAddressesAreOfPatchedUniversesAndBounded) {
    sources.prefer({1, 2, 3, 4, 5, 6});
    for (unsigned i = 0; i < 96; ++i) {
        SacnPacket packet = level(static_cast<std::uint8_t>(i % 16), 1);
        packet.universe = 7 + i;
        packet.sync = 100 + i;
        send(packet);
    }
    EXPECT_TRUE(sources.sync_addresses().empty());
    for (unsigned i = 0; i < 96; ++i) {
        SacnPacket packet = level(static_cast<std::uint8_t>(i % 16), 1);
        packet.universe = 1 + i / 16;
        packet.sync = 10000 + i;
        send(packet);
    }
    const auto addresses = sources.sync_addresses();
    EXPECT_EQ(addresses.size(), kMaxSyncAddresses);
    EXPECT_EQ(*addresses.begin(), 10000) << "those of the first patched universes";
}

TEST_F(Sacn, SynchronizationIsHeardAfterManyStrangersOnItsAddress) {
    SacnPacket packet = level(1, 10);
    packet.sync = 900;
    send(packet);
    for (unsigned stranger = 2; stranger < 40; ++stranger)
        send_raw(test::sacn_sync(static_cast<std::uint8_t>(stranger), 5, 900));
    wait(1500 * kMs);
    packet.slots[0] = 20;
    send(packet);
    EXPECT_EQ(levels(), (std::vector{10}));
    send_raw(test::sacn_sync(1, 1, 900));
    EXPECT_EQ(levels(), (std::vector{20})) << "the strangers' places make room";
}

TEST_F(Sacn, AForeignSenderOfSynchronizationDoesNotReleaseOtherAddresses) {
    SacnPacket packet = level(1, 10);
    packet.sync = 900;
    send(packet);
    send_raw(test::sacn_sync(1, 1, 900));
    wait(1500 * kMs);
    packet.slots[0] = 20;
    send(packet);
    send_raw(test::sacn_sync(1, 2, 901));
    EXPECT_EQ(levels(), (std::vector{10}));
}

}  // namespace
}  // namespace gonio
