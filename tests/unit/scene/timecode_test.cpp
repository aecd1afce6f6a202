// Time code at four rates, the bytes of MIDI and Art-Net, and what the list of cues does with it.
#include "protocol/timecode/timecode.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <vector>

#include "protocol/dmx/artnet.h"
#include "protocol/surface/midi.h"
#include "server/scene/scene.h"
#include "server/scene/timecode_chase.h"
#include "tests/shared_data.h"
#include "tests/unit/second.h"

namespace gonio {
namespace {

using enum TimecodeRate;

Timecode tc(const char* text, TimecodeRate rate) {
    return {*parse_timecode(text), rate};
}

TEST(TimecodeTest, FramesSinceMidnight) {
    EXPECT_EQ(frame_count(tc("01:02:03:04", film24)), (3600u + 123u) * 24 + 4);
    EXPECT_EQ(frame_count(tc("01:02:03:04", ebu25)), (3600u + 123u) * 25 + 4);
    EXPECT_EQ(frame_count(tc("01:02:03:04", smpte30)), (3600u + 123u) * 30 + 4);
    EXPECT_DOUBLE_EQ(seconds_of(tc("00:00:10:12", film24)), 10.5);
    EXPECT_DOUBLE_EQ(seconds_of(tc("00:00:10:15", smpte30)), 10.5);
}

// SMPTE ST 12-1: labels 0 and 1 are left out at the start of each minute but every tenth: an hour has 107,892 frames
// and a day 2,589,408.
TEST(TimecodeTest, DropFrameLeavesOutTwoLabelsAMinute) {
    EXPECT_EQ(frame_count(tc("00:00:59:29", drop30)), 1799u);
    EXPECT_EQ(frame_count(tc("00:01:00:02", drop30)), 1800u);
    EXPECT_EQ(frame_count(tc("00:10:00:00", drop30)), 17982u);
    EXPECT_EQ(frame_count(tc("01:00:00:00", drop30)), 107892u);
    EXPECT_EQ(frame_count(tc("23:59:59:29", drop30)), 2589407u);
    EXPECT_EQ(frame_count(tc("00:01:00:00", drop30)), 1800u) << "a label that is left out is the next one";
    EXPECT_NEAR(seconds_of(tc("01:00:00:00", drop30)), 3599.9964, 1e-9) << "107,892 * 1001/30000 s";
}

TEST(TimecodeTest, LabelsAndFramesGoBothWays) {
    for (const TimecodeRate rate : {film24, ebu25, drop30, smpte30}) {
        Timecode before = timecode_of(0, rate);
        for (std::uint32_t frame = 0; frame < 20 * 60 * 30; ++frame) {
            const Timecode now = timecode_of(frame, rate);
            ASSERT_TRUE(is_timecode(now));
            ASSERT_EQ(frame_count(now), frame) << print_timecode(now.label);
            if (frame > 0) {
                ASSERT_LT(before.label, now.label);
            }
            before = now;
        }
    }
    EXPECT_EQ(print_timecode(timecode_of(-1, ebu25).label), "23:59:59:24");
    EXPECT_EQ(print_timecode(timecode_of(2589408, drop30).label), "00:00:00:00");
}

TEST(TimecodeTest, TextsOfTimes) {
    EXPECT_EQ(print_timecode(*parse_timecode("1:2:3:4")), "01:02:03:04");
    EXPECT_EQ(print_timecode(*parse_timecode("23:59:59;29")), "23:59:59:29");
    for (const char* bad : {"", "1:2:3", "24:00:00:00", "00:60:00:00", "00:00:00:30", "00:00:00:00:", "a:0:0:0",
                            "00;00:00:00", "-1:0:0:0", "001:0:0:0"})
        EXPECT_FALSE(parse_timecode(bad)) << bad;
}

std::vector<std::uint8_t> quarters(const Timecode& time) {
    const unsigned frames = time.label.frames, seconds = time.label.seconds, minutes = time.label.minutes;
    const unsigned hours = time.label.hours, rate = static_cast<unsigned>(time.rate);
    const unsigned pieces[8] = {frames & 15,  frames >> 4,  seconds & 15, seconds >> 4,
                                minutes & 15, minutes >> 4, hours & 15,   hours >> 4 | rate << 1};
    std::vector<std::uint8_t> bytes;
    for (unsigned i = 0; i < 8; ++i) {
        bytes.push_back(0xF1);
        bytes.push_back(static_cast<std::uint8_t>(i << 4 | pieces[i]));
    }
    return bytes;
}

std::optional<Timecode> read(MtcReader& reader, const std::vector<std::uint8_t>& bytes) {
    std::optional<Timecode> newest;
    for (const std::uint8_t byte : bytes)
        if (const auto now = reader.take(byte)) newest = now;
    return newest;
}

// F0 7F 7F 01 01 hh mm ss ff F7: a locate, after which time is known.
void locate(MtcReader& reader, const Timecode& time) {
    const TimecodeLabel& label = time.label;
    const auto hours = static_cast<std::uint8_t>(static_cast<unsigned>(time.rate) << 5 | label.hours);
    EXPECT_EQ(read(reader, {0xF0, 0x7F, 0x7F, 0x01, 0x01, hours, label.minutes, label.seconds, label.frames, 0xF7}),
              time);
}

// Eight pieces take two frames: what they say is two frames old.
TEST(Mtc, QuarterFramesAreTwoFramesOld) {
    for (const TimecodeRate rate : {film24, ebu25, drop30, smpte30}) {
        MtcReader reader;
        locate(reader, tc("10:20:30:10", rate));
        EXPECT_EQ(read(reader, quarters(tc("10:20:30:10", rate))), tc("10:20:30:12", rate));
    }
    MtcReader reader;
    locate(reader, tc("00:00:59:28", drop30));
    EXPECT_EQ(read(reader, quarters(tc("00:00:59:28", drop30))), tc("00:01:00:02", drop30));
    // The bytes by hand: 01:02:03:04 at 25 frames.
    locate(reader, tc("01:02:03:04", ebu25));
    EXPECT_EQ(
        read(reader, {0xF1, 0x04, 0xF1, 0x10, 0xF1, 0x23, 0xF1, 0x30, 0xF1, 0x42, 0xF1, 0x50, 0xF1, 0x61, 0xF1, 0x72}),
        tc("01:02:03:06", ebu25));
}

// The time of each of the frames, as a sender says it that reads its running clock anew for every piece. `first`: the
// frame of piece 0; `change`: the piece from which on the clock shows the next one.
std::vector<std::uint8_t> spliced(std::int64_t first, int change, TimecodeRate rate) {
    const std::vector<std::uint8_t> before = quarters(timecode_of(first, rate)),
                                    middle = quarters(timecode_of(first + 1, rate)),
                                    after = quarters(timecode_of(first + 2, rate));
    std::vector<std::uint8_t> bytes;
    for (int piece = 0; piece < 8; ++piece) {
        const auto& now = piece < change ? before : piece < change + 4 ? middle : after;
        bytes.insert(bytes.end(), now.begin() + 2 * piece, now.begin() + 2 * piece + 2);
    }
    return bytes;
}

// SuperTimecodeConverter, issue 16: at a roll-over the pieces of two times make a third, which time never reaches. What
// counts is never far from the frame that runs, at any rate, over roll-overs of seconds, minutes, hours and the day.
TEST(Mtc, PiecesOfTwoTimesMakeNoThird) {
    for (const TimecodeRate rate : {film24, ebu25, drop30, smpte30})
        for (const char* begin :
             {"00:00:57:01", "00:00:57:00", "00:59:56:01", "09:59:57:00", "15:59:58:01", "23:59:57:01", "00:09:58:00"})
            for (int change = 0; change < 5; ++change) {
                MtcReader reader;
                std::size_t counted = 0;
                const std::int64_t from = frame_count(tc(begin, rate));
                for (int set = 0; set < 120; ++set) {
                    const std::int64_t frame = from + 2 * set;
                    const auto now = read(reader, spliced(frame, change, rate));
                    if (!now) continue;
                    ++counted;
                    // Two frames later, and at most two frames of doubt.
                    const std::int64_t day = frame_count(timecode_of(-1, rate)) + 1;
                    const std::int64_t off = (frame_count(*now) - (frame + 2) % day + day + 2) % day;
                    ASSERT_LE(off, 4) << print_timecode(now->label) << " for "
                                      << print_timecode(timecode_of(frame, rate).label);
                }
                EXPECT_GE(counted, 90u) << "what is right is not lost with it";
            }
}

TEST(Mtc, AJumpCountsWithItsSecondTime) {
    MtcReader reader;
    locate(reader, tc("01:00:00:00", ebu25));
    EXPECT_EQ(read(reader, quarters(tc("01:00:00:00", ebu25))), tc("01:00:00:02", ebu25));
    EXPECT_FALSE(read(reader, quarters(tc("02:00:00:00", ebu25)))) << "one alone may be wrong";
    EXPECT_EQ(read(reader, quarters(tc("02:00:00:02", ebu25))), tc("02:00:00:04", ebu25)) << "two are a jump";
    EXPECT_FALSE(read(reader, quarters(tc("01:00:00:00", ebu25)))) << "back likewise";
    EXPECT_TRUE(read(reader, quarters(tc("01:00:00:02", ebu25))));
    EXPECT_FALSE(read(reader, quarters(tc("01:00:00:04", smpte30)))) << "another rate is another time";
    EXPECT_TRUE(read(reader, quarters(tc("01:00:00:06", smpte30))));
    // One wrong time between right ones costs that one alone.
    EXPECT_FALSE(read(reader, quarters(tc("01:01:00:08", smpte30))));
    EXPECT_EQ(read(reader, quarters(tc("01:00:00:10", smpte30))), tc("01:00:00:12", smpte30));
    MtcReader fresh;
    EXPECT_FALSE(read(fresh, quarters(tc("03:00:00:00", ebu25)))) << "the first one of all may be wrong too";
    EXPECT_TRUE(read(fresh, quarters(tc("03:00:00:02", ebu25))));
    EXPECT_TRUE(read(fresh, quarters(tc("03:00:00:02", ebu25)))) << "the same again: the tape stands";
}

// The recording of the issue, where it is there.
TEST(Mtc, ARecordingOfASenderThatSplices) {
    const auto path = test::shared_data("cases/32-mtc-spliced/spliced.replay");
    if (!path) GTEST_SKIP() << "no shared cases on this machine";
    std::ifstream file(*path);
    MtcReader reader;
    std::optional<Timecode> last;
    std::string line;
    for (std::getline(file, line); std::getline(file, line);) {
        double at_ms = 0;
        unsigned status = 0, data = 0;
        if (std::sscanf(line.c_str(), "%lf %x %x", &at_ms, &status, &data) != 3) continue;
        for (const unsigned byte : {status, data})
            if (const auto now = reader.take(static_cast<std::uint8_t>(byte))) {
                EXPECT_TRUE(!last || frame_count(*last) <= frame_count(*now)) << print_timecode(now->label);
                EXPECT_LT(frame_count(*now), frame_count(tc("00:01:06:00", smpte30)));
                last = now;
            }
    }
    ASSERT_TRUE(last);
    EXPECT_GE(frame_count(*last), frame_count(tc("00:01:04:00", smpte30)));
}

TEST(Mtc, OnlyEightPiecesInARowCount) {
    MtcReader reader;
    std::vector<std::uint8_t> whole = quarters(tc("01:00:00:00", ebu25));
    locate(reader, tc("01:00:00:00", ebu25));
    EXPECT_FALSE(read(reader, {whole.begin() + 6, whole.end()})) << "from the middle on";
    EXPECT_TRUE(read(reader, whole));
    std::vector<std::uint8_t> lost = whole;
    lost.erase(lost.begin() + 4, lost.begin() + 6);
    EXPECT_FALSE(read(reader, lost));
    EXPECT_TRUE(read(reader, whole)) << "and the next ones count";
    std::vector<std::uint8_t> clocked;
    for (const std::uint8_t byte : whole) clocked.insert(clocked.end(), {0xF8, byte});
    EXPECT_TRUE(read(reader, clocked)) << "clocks may stand anywhere";
    std::vector<std::uint8_t> back;
    for (std::size_t i = 8; i-- > 0;) back.insert(back.end(), {0xF1, whole[2 * i + 1]});
    locate(reader, tc("01:00:00:00", ebu25));
    EXPECT_EQ(read(reader, back), tc("00:59:59:23", ebu25)) << "a tape that runs backwards";
}

TEST(Mtc, AFullFrameCountsAtOnce) {
    MtcReader reader;
    EXPECT_EQ(read(reader, {0xF0, 0x7F, 0x7F, 0x01, 0x01, 0x21, 0x02, 0x03, 0x04, 0xF7}), tc("01:02:03:04", ebu25));
    EXPECT_FALSE(read(reader, {0xF0, 0x7F, 0x7F, 0x01, 0x01, 0x21, 0x02, 0x03, 0x1D, 0xF7})) << "25 has no frame 29";
    EXPECT_FALSE(read(reader, {0xF0, 0x7F, 0x7F, 0x01, 0x01, 0x21, 0x02, 0x03, 0xF7})) << "too short";
    EXPECT_FALSE(read(reader, {0xF0, 0x7F, 0x7F, 0x01, 0x01, 0x21, 0x02, 0x03, 0x04, 0x00, 0xF7})) << "too long";
    EXPECT_FALSE(read(reader, {0xF0, 0x7F, 0x7F, 0x06, 0x01, 0x21, 0x02, 0x03, 0x04, 0xF7})) << "machine control";
}

// Of a raw port and of USB alike; controllers beside it stay what they are.
TEST(Mtc, BothKindsOfMidiPortReadIt) {
    std::vector<std::uint8_t> raw = quarters(tc("00:59:59:28", smpte30));
    const std::vector<std::uint8_t> later = quarters(tc("01:00:00:00", smpte30));
    raw.insert(raw.end(), later.begin(), later.end());
    raw.insert(raw.begin() + 4, {0xB0, 0x07, 0x40});
    MidiStream stream;
    std::vector<MidiMessage> messages;
    EXPECT_EQ(stream.take(raw, messages), 0u);
    EXPECT_EQ(messages, (std::vector<MidiMessage>{{0, 0xB0, {0x07, 0x40}}}));
    EXPECT_EQ(stream.take_news().timecode, tc("01:00:00:02", smpte30));
    EXPECT_TRUE(stream.take_news().empty());

    std::vector<std::uint8_t> usb;
    std::vector<std::uint8_t> plain = quarters(tc("00:59:59:28", smpte30));
    plain.insert(plain.end(), later.begin(), later.end());
    for (std::size_t i = 0; i < plain.size(); i += 2) usb.insert(usb.end(), {0x02, plain[i], plain[i + 1], 0x00});
    usb.insert(usb.end(), {0x0B, 0xB0, 0x07, 0x41});
    MidiSystem system;
    messages.clear();
    EXPECT_EQ(read_usb_midi(usb, messages, &system), 0u);
    EXPECT_EQ(messages, (std::vector<MidiMessage>{{0, 0xB0, {0x07, 0x41}}}));
    EXPECT_EQ(system.take_news().timecode, tc("01:00:00:02", smpte30));
    read_usb_midi(std::vector<std::uint8_t>{0x04, 0xF0, 0x7F, 0x7F, 0x04, 0x01, 0x01, 0x61, 0x04, 0x02, 0x03, 0x04,
                                            0x05, 0xF7, 0, 0},
                  messages, &system);
    EXPECT_EQ(system.take_news().timecode, tc("01:02:03:04", smpte30));
}

// Art-Net 4, "ArtTimeCode": 19 bytes; frames, seconds, minutes, hours, type.
TEST(ArtTimeCodeTest, PacketsOfTimeCode) {
    std::vector<std::uint8_t> packet = {'A', 'r', 't', '-', 'N', 'e', 't', 0, 0x00, 0x97, 0, 14, 0, 0, 24, 59, 2, 1, 1};
    const auto read = decode_artnet(packet);
    ASSERT_TRUE(read);
    ASSERT_TRUE(std::holds_alternative<ArtTimeCode>(*read));
    EXPECT_EQ(std::get<ArtTimeCode>(*read).timecode, tc("01:02:59:24", ebu25));
    packet[14] = 25;
    EXPECT_EQ(decode_artnet(packet).error().where, "byte 14");
    packet[14] = 0;
    packet[18] = 4;
    EXPECT_EQ(decode_artnet(packet).error().where, "byte 18");
    packet.pop_back();
    EXPECT_EQ(decode_artnet(packet).error().code, "bad_packet");
}

class Chase : public testing::Test {
protected:
    void SetUp() override {
        for (const auto& [number, time] :
             {std::pair{1000u, "01:00:10:00"}, {2000u, "01:00:20:00"}, {3000u, "01:00:30:00"}}) {
            auto cue = std::make_shared<Cue>();
            cue->number = number;
            cue->timecode = parse_timecode(time);
            cues.push_back(std::move(cue));
        }
        auto untimed = std::make_shared<Cue>();
        untimed->number = 4000;
        cues.push_back(std::move(untimed));
    }
    // Time code of so many seconds after 01:00:00:00, which comes at that time of the clock.
    std::vector<ChaseStart> hear(double code_s, double at_s) {
        return chase.take(timecode_of(90'000 + std::llround(code_s * 25), ebu25), ns(at_s), cues, 1.0);
    }
    std::vector<ChaseStart> step(double at_s) { return chase.step(ns(at_s), cues, 1.0); }
    static std::int64_t ns(double at_s) { return std::llround(at_s * kSecond); }
    static std::string said(const std::vector<ChaseStart>& starts) {
        std::string text;
        for (const ChaseStart& start : starts)
            text += (start.jumped ? "jump to " : "start ") + std::to_string(start.number / 1000) + " at " +
                    std::to_string(static_cast<double>(start.began_ns) * 1e-9).substr(0, 6) + ";";
        return text;
    }
    CueList cues;
    TimecodeChase chase;
};

TEST_F(Chase, ACueStartsWhenItsTimeIsCrossed) {
    EXPECT_EQ(said(hear(9, 100)), "") << "no cue lies before";
    std::string all;
    for (int frame = 1; frame <= 50; frame += 2) all += said(hear(9 + frame / 25.0, 100 + frame / 25.0));
    EXPECT_EQ(all, "start 1 at 101.00;");
    EXPECT_EQ(std::string(chase.state(ns(102), 1.0)), "running");
}

TEST_F(Chase, BetweenTwoMessagesTimeGoesOn) {
    hear(9.92, 100);
    EXPECT_EQ(chase.next_ns(cues, 1.0), ns(100.08));
    EXPECT_EQ(said(step(100.07)), "");
    EXPECT_EQ(said(step(100.09)), "start 1 at 100.08;");
    EXPECT_EQ(said(hear(10.04, 100.12)), "") << "it was started already";
}

TEST_F(Chase, AfterAJumpTheStateIsThereWithoutWhatLiesBetween) {
    hear(1, 100);
    EXPECT_EQ(said(hear(31, 100.04)), "jump to 3 at 99.040;") << "1 and 2 are not played";
    const auto back = hear(12, 100.08);
    EXPECT_EQ(said(back), "jump to 1 at 98.080;");
    EXPECT_EQ(back[0].before, 0u);
    EXPECT_EQ(hear(25, 100.12)[0].before, 1000u) << "2 grew out of 1";
    EXPECT_EQ(said(hear(2, 100.16)), "") << "before the first cue nothing is known";
    EXPECT_EQ(said(hear(2.04, 100.20)), "");
}

TEST_F(Chase, ADropOutFreewheelsThenHolds) {
    hear(9, 100);
    hear(9.52, 100.52);
    EXPECT_EQ(std::string(chase.state(ns(100.6), 1.0)), "running");
    EXPECT_EQ(std::string(chase.state(ns(101.0), 1.0)), "freewheeling");
    EXPECT_EQ(said(step(101.1)), "start 1 at 101.00;") << "0.6 s without a message";
    EXPECT_EQ(std::string(chase.state(ns(101.6), 1.0)), "holding");
    EXPECT_EQ(said(step(150)), "") << "held at 10.52 s";
    EXPECT_FALSE(chase.next_ns(cues, 1.0));
    EXPECT_EQ(said(hear(59.52, 150.52)), "jump to 3 at 121.00;") << "2 was not played while it was gone";
}

TEST_F(Chase, AShortDropOutIsNoJump) {
    hear(19.52, 100.02);
    hear(19.6, 100.1);
    EXPECT_EQ(said(hear(20.4, 100.9)), "start 2 at 100.50;");
}

// Art-Net's labels come whole, but nothing has compared them.
TEST_F(Chase, OneWrongLabelAmongRightOnesStartsNothing) {
    const auto hear_unsure = [&](double code_s, double at_s) {
        return chase.take(timecode_of(90'000 + std::llround(code_s * 25), ebu25), ns(at_s), cues, 1.0, false);
    };
    EXPECT_EQ(said(hear_unsure(11, 100)), "jump to 1 at 99.000;") << "the first one is where time is";
    EXPECT_EQ(said(hear_unsure(31, 100.04)), "");
    EXPECT_EQ(said(hear_unsure(11.08, 100.08)), "") << "time goes on as before";
    EXPECT_EQ(said(step(100.4)), "") << "and what was doubted is forgotten";
    EXPECT_EQ(said(hear_unsure(11.48, 100.48)), "");
    EXPECT_EQ(said(hear_unsure(2, 100.52)), "");
    EXPECT_EQ(said(hear_unsure(21, 100.56)), "") << "two wrong ones that contradict each other";
    EXPECT_EQ(said(hear_unsure(11.6, 100.6)), "");
    EXPECT_EQ(said(hear_unsure(31, 100.64)), "");
    EXPECT_EQ(said(hear_unsure(31.04, 100.68)), "jump to 3 at 99.640;") << "the second one agrees: a real jump";
    // A locate is one packet, and then nothing.
    EXPECT_EQ(said(hear_unsure(12, 100.72)), "");
    EXPECT_EQ(chase.next_ns(cues, 1.0), ns(100.92));
    EXPECT_EQ(said(step(100.9)), "");
    EXPECT_EQ(said(step(100.93)), "jump to 1 at 98.720;");
    EXPECT_EQ(said(hear_unsure(22, 105)), "jump to 2 at 103.00;") << "where nothing ran it counts at once";
}

TEST_F(Chase, PausedTimeCodeHolds) {
    hear(9.9, 100);
    for (int i = 1; i < 30; ++i) EXPECT_EQ(said(hear(9.92, 100 + i * 0.04)), "");
    EXPECT_EQ(said(step(101.5)), "");
    EXPECT_EQ(std::string(chase.state(ns(101.2), 1.0)), "holding");
    EXPECT_EQ(said(hear(9.96, 101.24)), "");
    EXPECT_EQ(said(hear(10, 101.28)), "start 1 at 101.28;") << "and goes on";
}

TEST_F(Chase, ACueTimeIsOfTheRateThatComes) {
    cues.resize(1);
    auto late = std::make_shared<Cue>(*cues[0]);
    late->timecode = parse_timecode("01:00:10:29");
    cues[0] = late;
    hear(10.9, 100);
    EXPECT_EQ(said(hear(11.0, 100.1)), "start 1 at 100.10;") << "25 frames have no 29: the next second";
    TimecodeChase drop;
    drop.take(tc("01:00:10:27", drop30), 0, cues, 1.0);
    EXPECT_EQ(drop.take(tc("01:00:10:29", drop30), ns(0.0667), cues, 1.0).size(), 1u);
}

}  // namespace
}  // namespace gonio
