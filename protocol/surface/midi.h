// MIDI 1.0 as control surfaces speak it: USB-MIDI event packets (USB Device Class Definition for MIDI Devices 1.0,
// clause 4), the byte stream of a raw port, names for messages. Pure.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "ies/core/result.h"
#include "protocol/text/byte_order.h"
#include "protocol/timecode/timecode.h"

namespace gonio {

// Time code of one port, and the newest that came and was not taken yet.
struct MidiTime {
    MtcReader reader;
    std::optional<Timecode> newest;
    void take(std::uint8_t byte) {
        if (const auto now = reader.take(byte)) newest = now;
    }
};

// One channel message. System messages carry no control: of them time code is read.
struct MidiMessage {
    std::uint8_t cable = 0;  // 0..15: which of a surface's ports
    std::uint8_t status = 0;
    std::array<std::uint8_t, 2> data{};  // the second is 0 where the message has only one
    auto operator<=>(const MidiMessage&) const = default;
};

// Adds the channel messages of one transfer, whole or not: what is left over of the last packet is not looked at.
// Result: how many packets were none (reserved index numbers, data bytes with the top bit set, a status that does not
// fit). Time code among them is read by `time`; null: nobody wants it.
std::size_t read_usb_midi(Bytes transfer, std::vector<MidiMessage>& messages, MidiTime* time = nullptr);

// The bytes of a raw port: running status, real-time bytes anywhere, SysEx skipped.
class MidiStream {
public:
    // Adds the messages that are complete. Result: how many bytes belonged to none (data without a status).
    std::size_t take(Bytes bytes, std::vector<MidiMessage>& messages);
    // Result: time code that came since this was asked last.
    std::optional<Timecode> take_time() { return std::exchange(time_.newest, std::nullopt); }

private:
    std::uint8_t status_ = 0;  // running; 0: none
    std::uint8_t first_ = 0;
    bool has_first_ = false, sysex_ = false, quarter_ = false;
    MidiTime time_;
};

// Result: a message, or a whole SysEx with F0 and F7, as USB-MIDI event packets for a cable.
std::vector<std::uint8_t> usb_midi_packets(std::uint8_t cable, Bytes message);

enum class MidiKind : std::uint8_t { cc, note, bend, pressure, poly, program };

// Which control of a surface a message belongs to.
struct MidiKey {
    std::uint8_t cable = 0;
    MidiKind kind = MidiKind::cc;
    std::uint8_t channel = 1;  // 1..16; 0: any
    std::uint8_t number = 0;   // of the controller or note; 0 for bend, pressure and program
    auto operator<=>(const MidiKey&) const = default;
};

// Result: "cc 1/7", "note 1/60", "bend 1", "pressure 1", "poly 1/60", "program 1"; cables but the first in front:
// "port 2: cc 1/7"; any channel: "cc */7".
std::string midi_key_text(const MidiKey& key);
// Result: the keys that the text lists: "cc 1/0-7", "bend 1-8", "note 1/8-11, note 1/20". Errors: "bad_surface" with
// the text as value; at most 128 keys.
Result<std::vector<MidiKey>> parse_midi_keys(std::string_view text);

// Result: the key of a channel message; a note-off has the key of its note.
MidiKey key_of(const MidiMessage& message);
// Result: what it says: 0..127, of a bend 0..16383; a note-off says 0.
std::uint32_t value_of(const MidiMessage& message);
// Result: the message that says `value` for the key; a channel of 0 is sent as 1.
std::vector<std::uint8_t> midi_message(const MidiKey& key, std::uint32_t value);

}  // namespace gonio
