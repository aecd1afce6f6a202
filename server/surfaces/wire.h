// A connection to one surface, and where surfaces are found. Everything here lives on the device thread.
#pragma once

#include <poll.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "ies/core/result.h"
#include "protocol/surface/midi.h"
#include "server/base/clock.h"

namespace gonio {

inline constexpr std::size_t kMaxUnsent = 16384;  // bytes that wait for a surface; beyond it messages are refused

// A surface that could be opened.
struct FoundSurface {
    std::string path;       // where: unique among those that are attached now, "hid /dev/hidraw0", "usb 1:5"
    std::string identity;   // which: "vvvv:pppp:SERIAL", else "vvvv:pppp@PORT"
    std::string product;    // what it calls itself
    std::string transport;  // "hid" | "usb-midi" | "alsa-midi" | "replay"
    std::uint16_t vendor_id = 0, product_id = 0;
    std::vector<std::uint8_t> descriptor;  // of hid: the report descriptor
    // Named by somebody or known to be a control surface: taken from the kernel's driver without asking.
    bool owned = false;
};

// What a wire tells, on the device thread, from within Backend::serve(); nothing after it was destroyed. Times are
// monotonic_ns().
struct WireEvents {
    std::function<void(std::span<const MidiMessage> messages, std::size_t bad, std::int64_t t_ns)> midi;
    std::function<void(Bytes report, std::int64_t t_ns)> report;
    std::function<void(std::string why)> gone;  // once; the wire is then to be destroyed, but not from within this call
    std::function<void(MidiNews news, std::int64_t t_ns)> system;  // what MIDI says beside its channels
};

class Wire {
public:
    virtual ~Wire() = default;
    // A MIDI message for a cable, or a HID report with its id in front (cable 0). Result: false: not taken,
    // because too much is on its way or the surface is gone.
    virtual bool write(std::uint8_t cable, Bytes bytes) = 0;
    // Result: whether what was taken has been lost since this was asked last: the surface is to be painted anew.
    virtual bool lost() { return false; }
};

class Backend {
public:
    virtual ~Backend() = default;
    // Result: the surfaces that are attached.
    virtual std::vector<FoundSurface> scan() = 0;
    // Errors: "claimed", "no_permission", "vanished", "device_failed", each one sentence.
    virtual Result<std::unique_ptr<Wire>> open(const FoundSurface& surface, WireEvents events) = 0;
    // What poll() shall wait for besides, and until when (0: for ever).
    virtual void watch(std::vector<pollfd>&) const {}
    virtual std::int64_t due_ns() const { return 0; }
    // Reads and writes without blocking.
    virtual void serve() = 0;
    // Result: whether something was plugged or pulled since this was asked last, where the system tells.
    virtual bool changed() { return false; }
};

// Class-compliant USB-MIDI surfaces over libusb, without the kernel's sound system: alternate setting 0, three
// transfers in flight for each surface. `owned`: "vvvv:pppp" that may be taken from the kernel's driver; also below.
std::unique_ptr<Backend> make_usb_midi_backend(std::vector<std::string> owned);
// Raw MIDI ports of the kernel's sound system (/dev/snd/midiCxDy), the second way to a surface: for those that are
// shared with other programs, on other buses, or virtual. Needs no library and nothing where there is no sound.
std::unique_ptr<Backend> make_alsa_midi_backend(std::vector<std::string> owned);
// HID surfaces over hidapi (its hidraw backend). Every device has a thread of its own that reads and writes it, because
// hidapi gives no descriptor to wait for. What it reads comes to the device thread through a queue. Devices in wanted
// ("vvvv:pppp") are surfaces because somebody says so. wake: any thread.
std::unique_ptr<Backend> make_hid_backend(std::vector<std::string> wanted, std::function<void()> wake);

// Result: "vvvv:pppp:SERIAL", or "vvvv:pppp@port" where the serial number is none that tells surfaces apart.
std::string surface_identity(std::uint16_t vendor, std::uint16_t product, const std::string& serial,
                             const std::string& port);
// Result: the content of a small file without the line end; empty where there is none. At most 4096 bytes.
std::string small_file(const std::string& path);
// Result: the USB port ("1-2.3") of a device in sysfs, by the path of its node's folder; empty where it is none of
// USB's.
std::string usb_port_of(const std::string& sysfs_path);
// Result: the devices of a folder of sysfs, each with its number in `file` and where it stands, sorted. Enumerating
// reads many files: it need be done only where this list is another one.
std::vector<std::string> nodes_in(const std::string& folder, const std::string& file);

}  // namespace gonio
