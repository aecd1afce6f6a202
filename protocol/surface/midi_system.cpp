#include "protocol/surface/midi_system.h"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "protocol/schema/cue_number.h"

namespace gonio {
namespace {

constexpr std::uint8_t kRealTime = 0x7F, kNonRealTime = 0x7E, kAllDevices = 0x7F;
constexpr std::uint8_t kShowControl = 0x02, kLighting = 0x01, kAllTypes = 0x7F, kGo = 0x01;
constexpr std::uint8_t kDeviceControl = 0x04, kMasterVolume = 0x01;

std::string hex(std::uint8_t byte) {
    char text[4];
    std::snprintf(text, sizeof text, " %02X", byte);
    return text;
}

// Of universal messages, by their first sub-id (MIDI 1.0, table VIIa).
const char* universal_name(std::uint8_t id, std::uint8_t sub_id) {
    if (id == kNonRealTime) return sub_id == 0x06 ? "general information" : "universal, not of real time";
    constexpr const char* kNames[] = {
        "universal",      "time code",           "MIDI Show Control",    "notation",
        "device control", "cueing in real time", "MIDI Machine Control", "answer of MIDI Machine Control"};
    return sub_id < std::size(kNames) ? kNames[sub_id] : "universal";
}

// Of messages that are neither a channel's nor SysEx. Clocks and active sensing come all the time and ask for nothing.
const char* common_name(std::uint8_t status) {
    switch (status) {
        case 0xF2:
            return "song position";
        case 0xF3:
            return "song select";
        case 0xF6:
            return "tune request";
        case 0xFA:
            return "start";
        case 0xFB:
            return "continue";
        case 0xFC:
            return "stop";
        case 0xFF:
            return "reset";
        default:
            return nullptr;
    }
}

}  // namespace

void count_ignored(IgnoredKinds& ignored, const std::string& kind, std::uint32_t count) {
    if (count == 0) return;
    const bool room = ignored.size() + 1 < kMaxIgnoredKinds || ignored.contains(kind);
    ignored[room ? kind : "others"] += count;
}

std::string sysex_kind(Bytes message) {
    if (message.empty()) return "sysex without content";
    std::string text = "sysex" + hex(message[0]);
    if (message[0] != kRealTime && message[0] != kNonRealTime) {  // 00: the manufacturer has three bytes
        if (message[0] == 0 && message.size() >= 3) text += hex(message[1]) + hex(message[2]);
        return text + " (of a manufacturer)";
    }
    if (message.size() < 3) return text + " (cut short)";
    text += hex(message[2]) + " (" + universal_name(message[0], message[2]);
    if (message[0] == kRealTime && message[2] == kShowControl && message.size() >= 5)
        text += ", device" + hex(message[1]) + ", format" + hex(message[3]) + ", command" + hex(message[4]);
    return text + ")";
}

namespace {

bool is_go(Bytes message) {
    return message.size() >= 5 && message[0] == kRealTime && message[1] == kAllDevices && message[2] == kShowControl &&
           (message[3] == kLighting || message[3] == kAllTypes) && message[4] == kGo;
}

}  // namespace

std::optional<std::string> show_control_cue(Bytes message) {
    if (!is_go(message)) return std::nullopt;
    // The number of the cue, and behind a zero those of list and path: there is one list.
    const auto begin = message.begin() + 5, end = std::find(begin, message.end(), 0);
    if (begin == end) return "go";
    std::string number(begin, end);
    if (!parse_cue_number(number)) return std::nullopt;
    return number;
}

void MidiSystem::take(std::uint8_t byte, std::uint8_t cable, std::vector<MidiMessage>& messages) {
    const auto time = time_.take(byte);
    if (time) news_.timecode = time;
    if (byte < 0x80) {
        if (!in_sysex_ || cable != sysex_cable_) return;
        too_long_ = too_long_ || sysex_.size() == kMaxSysexBytes;
        if (!too_long_) sysex_.push_back(byte);
        return;
    }
    if (const char* name = common_name(byte)) count_ignored(news_.ignored, name);
    if (byte >= 0xF8) return;  // real-time: may stand inside any message
    if (in_sysex_ && cable != sysex_cable_ && byte != 0xF0) return;
    if (std::exchange(in_sysex_, byte == 0xF0)) {
        if (byte == 0xF7)
            take_sysex(time.has_value(), cable, messages);
        else
            count_ignored(news_.ignored, "sysex that does not end");
    }
    sysex_.clear();
    too_long_ = false;
    sysex_cable_ = cable;
}

void MidiSystem::take_sysex(bool is_time, std::uint8_t cable, std::vector<MidiMessage>& messages) {
    if (is_time) return;
    const std::vector<std::uint8_t>& said = sysex_;
    const bool volume =
        said.size() == 6 && said[0] == kRealTime && said[2] == kDeviceControl && said[3] == kMasterVolume && !too_long_;
    if (volume) {
        messages.push_back({cable, kVolume, {said[4], said[5]}});
        return;
    }
    if (auto cue = show_control_cue(said); cue && !too_long_ && news_.cues.size() < kMaxMidiCues) {
        news_.cues.push_back(std::move(*cue));
        return;
    }
    if (!is_go(said))
        count_ignored(news_.ignored, sysex_kind(said));
    else if (news_.cues.size() == kMaxMidiCues)
        count_ignored(news_.ignored, "GO of MIDI Show Control beyond 64 at once");
    else
        count_ignored(news_.ignored, "GO of MIDI Show Control whose cue is no number");
}

MidiNews MidiSystem::take_news() {
    return std::exchange(news_, {});
}

}  // namespace gonio
