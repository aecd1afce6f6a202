// Boxes that umockdev pretends: what the kernel would show in /sys and /dev, and what a device would answer. Only under
// umockdev-wrapper.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include <umockdev.h>

namespace gonio::test {

using ByteVector = std::vector<std::uint8_t>;

// A hidraw device 1209:0001 with the serial number SN0042: eight 10-bit sliders, 16 buttons, 16 lamps.
class MockHid {
public:
    explicit MockHid(UMockdevTestbed* testbed) : testbed_(testbed) {}
    void plug();
    void unplug();
    // One report: a pseudo terminal keeps no borders between two, so this waits until the reader has had time.
    void report(const ByteVector& bytes);
    // Result: the next output report, or nothing within 2 s.
    ByteVector output();

private:
    UMockdevTestbed* testbed_;
    UMockdevIoctlBase* handler_ = nullptr;
    int master_ = -1, plugged_ = 0;
    std::string node_;
};

// A class-compliant USB-MIDI device with the ids of a nanoKONTROL2, its MIDIStreaming interface bound to the kernel's
// driver.
class MockUsbMidi {
public:
    explicit MockUsbMidi(UMockdevTestbed* testbed);
    ~MockUsbMidi();
    void plug();
    void unplug();
    // What claiming the interface answers: 0, or an errno.
    void answer_claims(int error) { claim_error_ = error; }
    void packets(const ByteVector& bytes);
    // Result: the bytes that arrived at the OUT endpoint since the last call; waits up to 2 s for some.
    ByteVector output();
    bool detached() const { return detached_; }
    std::size_t most_in_flight() const { return most_in_flight_; }

private:
    static gboolean on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self);
    bool handle(UMockdevIoctlClient* client);
    void submit(UMockdevIoctlClient* client, UMockdevIoctlData* argument);
    void reap(UMockdevIoctlClient* client, UMockdevIoctlData* argument);
    void complete_inputs();

    UMockdevTestbed* testbed_;
    UMockdevIoctlBase* handler_;
    std::recursive_mutex mutex_;
    std::vector<UMockdevIoctlData*> inputs_, ready_;  // URBs
    ByteVector to_host_, from_host_;
    std::size_t most_in_flight_ = 0;
    std::atomic<bool> removed_{false}, detached_{false};
    std::atomic<int> claim_error_{0};
};

}  // namespace gonio::test
