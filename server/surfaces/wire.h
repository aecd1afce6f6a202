// A connection to one surface, and the places where surfaces are found. Everything here lives on the device thread.
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

namespace gonio {

inline std::int64_t device_clock_ns() {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * std::int64_t{1'000'000'000} + now.tv_nsec;
}

// A surface that could be opened.
struct FoundSurface {
    std::string place;      // where: unique among those that are attached now, "hid /dev/hidraw0", "usb 1:5"
    std::string identity;   // which: "vvvv:pppp:SERIAL", else "vvvv:pppp@PORT"
    std::string product;    // what it calls itself
    std::string transport;  // "hid" | "usb-midi" | "alsa-midi" | "replay"
    std::uint16_t vendor_id = 0, product_id = 0;
    std::vector<std::uint8_t> descriptor;  // of hid: the report descriptor
    bool owned =
        false;  // named by somebody or known to be a control surface: taken from the kernel's driver without asking
};

// What a wire tells, on the device thread, from within Backend::serve(); nothing after it was destroyed.
struct WireEvents {
    std::function<void(std::span<const MidiMessage> messages, std::size_t bad, std::int64_t t_ns)> midi;
    std::function<void(Bytes report, std::int64_t t_ns)> report;
    std::function<void(std::string why)> gone;  // once; the wire is then to be destroyed, but not from within this call
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
    virtual void watch(std::vector<pollfd>& fds) const = 0;
    virtual std::int64_t due_ns() const { return 0; }
    // Reads and writes without blocking.
    virtual void serve() = 0;
    // Result: whether something was plugged or pulled since this was asked last, where the system tells.
    virtual bool changed() { return false; }
};

// Result: "vvvv:pppp:SERIAL", or "vvvv:pppp@port" where the serial number is none that tells surfaces apart.
std::string surface_identity(std::uint16_t vendor, std::uint16_t product, const std::string& serial,
                             const std::string& port);
// Result: the content of a small file without the line end; empty where there is none. At most 4096 bytes.
std::string small_file(const std::string& path);
// Result: the USB port ("1-2.3") of a device in sysfs, by the path of its node's folder; empty where it is none of
// USB's.
std::string usb_port_of(const std::string& sysfs_path);

}  // namespace gonio
