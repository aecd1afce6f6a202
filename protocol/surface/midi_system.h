// What a MIDI port says beside its channels (MIDI 1.0 Detailed Specification; MIDI Show Control 1.1): time code, the
// cues of MIDI Show Control, the master volume. What nothing here understands is counted by its kind. Pure.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "ies/core/result.h"
#include "protocol/text/byte_order.h"
#include "protocol/timecode/timecode.h"

namespace gonio {

// One message that carries a control: of a channel, or the universal master volume. That one has the status kVolume and
// its data is the fine half and the coarse half of 14 bits.
struct MidiMessage {
    std::uint8_t cable = 0;  // 0..15: which of a surface's ports
    std::uint8_t status = 0;
    std::array<std::uint8_t, 2> data{};  // the second is 0 where the message has only one
    auto operator<=>(const MidiMessage&) const = default;
};
inline constexpr std::uint8_t kVolume = 0xF0;

inline constexpr std::size_t kMaxSysexBytes = 64;    // of one message that are looked at
inline constexpr std::size_t kMaxMidiCues = 64;      // that wait to be taken; more are counted as not understood
inline constexpr std::size_t kMaxIgnoredKinds = 16;  // the others are counted as one

// How many messages of each kind were not understood.
using IgnoredKinds = std::map<std::string, std::uint32_t>;
void count_ignored(IgnoredKinds& ignored, const std::string& kind, std::uint32_t count = 1);

struct MidiNews {
    std::optional<Timecode> timecode;  // the newest
    std::vector<std::string> cues;     // "go", or the number of the cue to go to, in their order
    IgnoredKinds ignored;
    bool empty() const { return !timecode && cues.empty() && ignored.empty(); }
};

class MidiSystem {
public:
    // One byte of the port, whatever it belongs to. Adds the master volume to `messages`.
    void take(std::uint8_t byte, std::uint8_t cable, std::vector<MidiMessage>& messages);
    // Result: what came since this was asked last.
    MidiNews take_news();

private:
    void take_sysex(bool is_time, std::uint8_t cable, std::vector<MidiMessage>& messages);

    MtcReader time_;
    MidiNews news_;
    std::vector<std::uint8_t> sysex_;  // without F0, at most kMaxSysexBytes
    bool in_sysex_ = false, too_long_ = false;
    std::uint8_t sysex_cable_ = 0;  // other cables' messages may come between its packets
};

// Result: what a SysEx is, without F0 and F7: "sysex 7F 02 (MIDI Show Control)", "sysex 00 20 29 (of a manufacturer)".
std::string sysex_kind(Bytes message);
// Result: "go", or the number of the cue, of a GO to all devices for lighting or for all types. Nothing of any other
// message, and where the number is none. message: without F0 and F7.
std::optional<std::string> show_control_cue(Bytes message);

}  // namespace gonio
