// Class-compliant USB-MIDI boxes over libusb, without the kernel's sound system: alternate setting 0, three transfers
// in flight for each box.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "server/control/wire.h"

namespace gonio {

// owned: "vvvv:pppp" that may be taken from the kernel's driver.
std::unique_ptr<Backend> make_usb_midi_backend(std::vector<std::string> owned);

// The MIDIStreaming interface of a device (USB MIDI 1.0: class 1, subclass 3).
struct UsbMidiPlace {
    std::uint8_t interface = 0, in = 0, out = 0;  // endpoint addresses; out 0: none
    std::uint16_t packet_bytes = 64;
    bool interrupt = false;
};

}  // namespace gonio
