// The device side of the boxes, on the machine that runs the test: a composite USB gadget (HID and MIDI) on dummy_hcd,
// and HID devices through uhid. Needs root.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace gonio::test {

using ByteVector = std::vector<std::uint8_t>;

// A Mackie Control (1397:00bc, serial number SN0042) that also has HID: eight 10-bit sliders, 16 buttons and 16 lamps.
class Gadget {
public:
    Gadget();  // through configfs, not plugged yet
    void plug();
    void unplug();
    void send_midi(const ByteVector& bytes);
    // Result: what the host has sent until `wanted` stands in it, or all that came within 3 s.
    ByteVector midi_until(const ByteVector& wanted);
    ByteVector midi_within(int ms);  // all that the host sends in this time
    void send_report(const ByteVector& report);
    ByteVector output_report();  // the next one from the host; empty after 3 s

private:
    void open_nodes();
    void close_nodes();
    int midi_ = -1, hid_ = -1;
};

// A HID device without USB.
class UhidDevice {
public:
    UhidDevice(const char* name, const char* serial, std::uint32_t vendor, std::uint32_t product,
               const ByteVector& descriptor);
    ~UhidDevice();
    UhidDevice(const UhidDevice&) = delete;
    void report(const ByteVector& bytes);
    ByteVector output();  // the next output report; empty after 3 s

private:
    int fd_;
};

}  // namespace gonio::test
