// MIDI 1.0 as control surfaces speak it: USB-MIDI event packets (USB Device Class Definition for MIDI Devices 1.0,
// clause 4), the byte stream of a raw port, names for messages. Pure.
#pragma once

#include <compare>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/surface/midi_system.h"

namespace gonio {

// Adds the messages of one transfer, whole or not: what is left over of the last packet is not looked at. Result: how
// many packets were none (reserved index numbers, data bytes with the top bit set, a status that does not fit). System
// messages among them are read by `system`; null: nobody wants them.
std::size_t read_usb_midi(Bytes transfer, std::vector<MidiMessage>& messages, MidiSystem* system = nullptr);

// The bytes of a raw port: running status, real-time bytes anywhere, system messages as MidiSystem reads them.
class MidiStream {
public:
    // Adds the messages that are complete. Result: how many bytes belonged to none (data without a status).
    std::size_t take(Bytes bytes, std::vector<MidiMessage>& messages);
    // Result: what system messages said since this was asked last.
    MidiNews take_news() { return system_.take_news(); }

private:
    std::uint8_t status_ = 0;  // running; 0: none
    std::uint8_t first_ = 0;
    bool has_first_ = false, sysex_ = false;
    unsigned skips_ = 0;  // data bytes of a system common message that are still to come
    MidiSystem system_;
};

// Result: a message, or a whole SysEx with F0 and F7, as USB-MIDI event packets for a cable.
std::vector<std::uint8_t> usb_midi_packets(std::uint8_t cable, Bytes message);

enum class MidiKind : std::uint8_t { cc, note, bend, pressure, poly, program, volume };

// Which control of a surface a message belongs to.
struct MidiKey {
    std::uint8_t cable = 0;
    MidiKind kind = MidiKind::cc;
    std::uint8_t channel = 1;  // 1..16; 0: any; the universal master volume has none: 0
    std::uint8_t number = 0;   // of the controller or note; 0 for bend, pressure, program and volume
    auto operator<=>(const MidiKey&) const = default;
};

// Result: "cc 1/7", "note 1/60", "bend 1", "pressure 1", "poly 1/60", "program 1", "volume *"; cables but the first in
// front: "port 2: cc 1/7"; any channel: "cc */7".
std::string midi_key_text(const MidiKey& key);
// Result: the keys that the text lists: "cc 1/0-7", "bend 1-8", "note 1/8-11, note 1/20". Errors: "bad_surface" with
// the text as value; at most 128 keys.
Result<std::vector<MidiKey>> parse_midi_keys(std::string_view text);

// Result: the key of a channel message; a note-off has the key of its note.
MidiKey key_of(const MidiMessage& message);
// Result: what it says: 0..127, of a bend and the volume 0..16383; a note-off says 0.
std::uint32_t value_of(const MidiMessage& message);
// Result: the message that says `value` for the key; a channel of 0 is sent as 1.
std::vector<std::uint8_t> midi_message(const MidiKey& key, std::uint32_t value);

}  // namespace gonio
