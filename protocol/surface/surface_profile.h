// A surface of controls as its profile describes it, and what its controls say. Plain data; the decoders are
// midi_surface.h and hid_surface.h.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocol/schema/surface.pb.h"
#include "protocol/surface/midi.h"

namespace gonio {

inline constexpr std::size_t kMaxSurfaceControls =
    1024;  // of one surface; messages of further ones are ignored and counted

enum class ControlKind : std::uint8_t {
    absolute,  // stands somewhere between its ends
    relative,  // turns without end and says how far
    button
};
const char* control_kind_name(ControlKind kind);

// How a MIDI message says a turn: 1 to 63 and 127 down to 65; bit 6 is the sign; 64 is no turn.
enum class RelativeCode : std::uint8_t { twos_complement, sign_bit, offset_64 };

// How a control shows a value.
enum class ShowKind : std::uint8_t {
    none,
    lamp,      // a message says on or off
    value,     // a message says 0..127: a ring that the surface draws itself
    ring_mcu,  // Mackie Control: 0x21 + 0..10, a ring of 11 lamps in wrap mode, filled from the left
    motor      // the control's own message moves it
};

struct ControlSpec {
    std::string name;
    ControlKind kind = ControlKind::absolute;
    std::uint32_t steps = 0;    // of an absolute control's whole way: 127, 1023, 16383
    bool centred = false;       // springs back to its middle: by default a speed
    double deadband_ratio = 0;  // movements up to this are noise
    ShowKind show = ShowKind::none;
    std::uint8_t on = 127, off = 0;  // of a lamp
    // MIDI:
    std::optional<MidiKey> input;
    bool pair = false;  // 14 bits in two controllers, n and n + 32
    RelativeCode code = RelativeCode::twos_complement;
    std::optional<MidiKey> touch;  // says whether a hand is on it
    MidiKey output;
};

struct SurfaceProfile {
    std::string name;
    std::vector<std::string> usb;       // "vvvv:pppp" of the surfaces that it describes
    std::vector<ControlSpec> controls;  // names differ
    std::vector<v1::SurfaceRow> rows;   // what they drive unless somebody says otherwise; `device` is empty
    std::vector<std::uint8_t> hello;    // SysEx sent when the surface comes, F0 to F7
    double repaint_s = 0;               // it forgets what it was shown: everything is sent again so often; 0: never
};

// What a control has said. `value` is 0..1 of an absolute control, clicks of a relative one, 0 or 1 of a button.
struct ControlEvent {
    enum class What : std::uint8_t { moved, touched } what = What::moved;
    std::size_t control = 0;  // index into the surface's controls
    double value = 0;
};

}  // namespace gonio
