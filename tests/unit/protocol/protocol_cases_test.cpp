// What boxes and consoles of the shared cases send, each against its README. Own messages of the same kinds are in the
// tests of each protocol.
#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <sstream>
#include <string>

#include "protocol/dmx/artnet.h"
#include "protocol/dmx/patch_toml.h"
#include "protocol/schema/console.pb.h"
#include "protocol/surface/midi.h"
#include "protocol/surface/midi_system.h"
#include "tests/shared_data.h"

namespace gonio {
namespace {

// Text of a file of the shared cases; empty where this machine has none.
std::string shared_case_text(const std::string& name) {
    const auto path = test::shared_data("cases/" + name);
    if (!path) return {};
    std::ifstream file(*path);
    return {std::istreambuf_iterator<char>(file), {}};
}

// The bytes of all lines of a replayed MIDI box.
std::vector<std::uint8_t> bytes_of_replay(const std::string& text) {
    std::vector<std::uint8_t> bytes;
    std::istringstream lines(text);
    std::string line;
    std::getline(lines, line);  // the box's name
    while (std::getline(lines, line)) {
        std::istringstream words(line);
        double at_ms = 0.0;
        words >> at_ms >> std::hex;
        for (unsigned byte = 0; words >> byte;) bytes.push_back(static_cast<std::uint8_t>(byte));
    }
    return bytes;
}

TEST(ProtocolCases, MidiShowControlStartsItsCue) {
    const std::string text = shared_case_text("34-msc-mmc/msc.replay");
    if (text.empty()) GTEST_SKIP() << "no shared cases on this machine";
    MidiStream stream;
    std::vector<MidiMessage> messages;
    EXPECT_EQ(stream.take(bytes_of_replay(text), messages), 0u);
    const MidiNews news = stream.take_news();
    EXPECT_EQ(news.cues, (std::vector<std::string>{"2", "go"}));
    EXPECT_EQ(news.ignored, (IgnoredKinds{{"sysex 7F 06 (MIDI Machine Control)", 1}}));
}

// The slider goes from 0 to its end, which is 114 in this recording.
TEST(ProtocolCases, TheMasterVolumeOfABoxIsASlider) {
    const std::string text = shared_case_text("35-sysex-slider/easypad.replay");
    if (text.empty()) GTEST_SKIP() << "no shared cases on this machine";
    MidiStream stream;
    std::vector<MidiMessage> messages;
    EXPECT_EQ(stream.take(bytes_of_replay(text), messages), 0u);
    EXPECT_TRUE(stream.take_news().empty());
    ASSERT_EQ(messages.size(), 20u);
    for (std::size_t i = 0; i < messages.size(); ++i) {
        EXPECT_EQ(midi_key_text(key_of(messages[i])), "volume *");
        EXPECT_EQ(value_of(messages[i]), 6 * i << 7);
    }
}

// Each port address is the net and sub-net of a reply with a SwOut of one of its ports.
TEST(ProtocolCases, RepliesToAPollNameEveryPatchedUniverse) {
    const std::string text = shared_case_text("43-artnet-poll-many/patch.toml");
    if (text.empty()) GTEST_SKIP() << "no shared cases on this machine";
    const auto patch = read_patch_toml(text);
    ASSERT_TRUE(patch) << patch.error().text();
    ArtNode node;
    std::set<unsigned> patched, named;
    for (const v1::PatchRow& row : patch->rows()) {
        node.universes.push_back(static_cast<std::uint16_t>(row.universe()));
        patched.insert(row.universe());
    }
    ASSERT_EQ(patched.size(), 9u);
    unsigned bind_index = 0;
    for (const ArtPollReply& reply : art_poll_replies(node)) {
        EXPECT_EQ(reply.size(), 239u);
        EXPECT_EQ(reply[211], ++bind_index);
        for (std::size_t port = 0; port < reply[173]; ++port)
            named.insert(static_cast<unsigned>(reply[18]) << 8 | static_cast<unsigned>(reply[19]) << 4 |
                         reply[190 + port]);
    }
    EXPECT_EQ(named, patched);
}

}  // namespace
}  // namespace gonio
