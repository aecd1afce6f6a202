// Class-compliant USB-MIDI surfaces over libusb, without the kernel's sound system: alternate setting 0, three
// transfers in flight for each surface.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "server/surfaces/wire.h"

namespace gonio {

// owned: "vvvv:pppp" that may be taken from the kernel's driver.
std::unique_ptr<Backend> make_usb_midi_backend(std::vector<std::string> owned);

}  // namespace gonio
