// Raw MIDI ports of the kernel's sound system (/dev/snd/midiCxDy), the second way to a surface: for those that are
// shared with other programs, on other buses, or virtual. Needs no library and nothing where there is no sound.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "server/surfaces/wire.h"

namespace gonio {

std::unique_ptr<Backend> make_alsa_midi_backend(std::vector<std::string> owned);

}  // namespace gonio
