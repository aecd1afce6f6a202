#include "tests/usb/gadget.h"

#include <fcntl.h>
#include <linux/input.h>
#include <linux/uhid.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <thread>

namespace gonio::test {
namespace {

const std::string kRoot = "/sys/kernel/config/usb_gadget/box";

const ByteVector kDescriptor = {0x05, 0x01, 0x09, 0x04, 0xA1, 0x01, 0x85, 0x01, 0x05, 0x01, 0x09, 0x36, 0x09, 0x36,
                                0x09, 0x36, 0x09, 0x36, 0x09, 0x36, 0x09, 0x36, 0x09, 0x36, 0x09, 0x36, 0x15, 0x00,
                                0x26, 0xFF, 0x03, 0x75, 0x10, 0x95, 0x08, 0x81, 0x02, 0x05, 0x09, 0x19, 0x01, 0x29,
                                0x10, 0x15, 0x00, 0x25, 0x01, 0x75, 0x01, 0x95, 0x10, 0x81, 0x02, 0x85, 0x02, 0x05,
                                0x08, 0x19, 0x01, 0x29, 0x10, 0x75, 0x01, 0x95, 0x10, 0x91, 0x02, 0xC0};

void put(const std::string& path, const std::string& text) {
    const int fd = ::open(path.c_str(), O_WRONLY);
    if (fd < 0 || ::write(fd, text.data(), text.size()) != static_cast<ssize_t>(text.size()))
        std::fprintf(stderr, "cannot write %s: %s\n", path.c_str(), std::strerror(errno));
    if (fd >= 0) ::close(fd);
}

void folder(const std::string& path) {
    std::filesystem::create_directories(path);
}

void pause_ms(int ms) {
    std::this_thread::sleep_for(std::chrono::milliseconds(ms));
}

ByteVector read_within(int fd, int ms) {
    pollfd state{fd, POLLIN, 0};
    if (::poll(&state, 1, ms) <= 0) return {};
    ByteVector bytes(512);
    const ssize_t count = ::read(fd, bytes.data(), bytes.size());
    bytes.resize(static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
    return bytes;
}

std::string midi_node() {
    for (int card = 0; card < 8; ++card) {
        std::ifstream file("/proc/asound/card" + std::to_string(card) + "/id");
        std::string id;
        if (std::getline(file, id) && id == "boxmidi") return "/dev/snd/midiC" + std::to_string(card) + "D0";
    }
    return {};
}

}  // namespace

Gadget::Gadget() {
    folder(kRoot);
    put(kRoot + "/idVendor", "0x1397");
    put(kRoot + "/idProduct", "0x00bc");
    put(kRoot + "/bcdDevice", "0x0100");
    put(kRoot + "/bcdUSB", "0x0200");
    folder(kRoot + "/strings/0x409");
    folder(kRoot + "/configs/c.1/strings/0x409");
    put(kRoot + "/strings/0x409/serialnumber", "SN0042");
    put(kRoot + "/strings/0x409/manufacturer", "Acme");
    put(kRoot + "/strings/0x409/product", "Motor Box");
    folder(kRoot + "/functions/hid.0");
    put(kRoot + "/functions/hid.0/protocol", "0");
    put(kRoot + "/functions/hid.0/subclass", "0");
    put(kRoot + "/functions/hid.0/report_length", "19");
    put(kRoot + "/functions/hid.0/report_desc", std::string(kDescriptor.begin(), kDescriptor.end()));
    folder(kRoot + "/functions/midi.0");
    put(kRoot + "/functions/midi.0/in_ports", "1");
    put(kRoot + "/functions/midi.0/out_ports", "1");
    put(kRoot + "/functions/midi.0/id", "boxmidi");
    for (const char* function : {"hid.0", "midi.0"})
        if (::symlink((kRoot + "/functions/" + function).c_str(), (kRoot + "/configs/c.1/" + function).c_str()) != 0)
            std::perror(function);
}

void Gadget::plug() {
    put(kRoot + "/UDC", "dummy_udc.0");
    open_nodes();
}

void Gadget::unplug() {
    close_nodes();
    put(kRoot + "/UDC", "\n");
}

void Gadget::open_nodes() {
    for (int i = 0; i < 200 && (midi_ < 0 || hid_ < 0); ++i) {
        if (hid_ < 0) hid_ = ::open("/dev/hidg0", O_RDWR | O_NONBLOCK);
        if (const std::string node = midi_node(); midi_ < 0 && !node.empty())
            midi_ = ::open(node.c_str(), O_RDWR | O_NONBLOCK);
        pause_ms(10);
    }
    if (midi_ >= 0) read_within(midi_, 0);  // a raw port takes nothing in before it is first read
    if (midi_ < 0 || hid_ < 0) std::fprintf(stderr, "the gadget has no nodes: midi %d, hid %d\n", midi_, hid_);
}

void Gadget::close_nodes() {
    for (int* fd : {&midi_, &hid_}) {
        if (*fd >= 0) ::close(*fd);
        *fd = -1;
    }
}

void Gadget::send_midi(const ByteVector& bytes) {
    for (std::size_t sent = 0, tries = 0; sent < bytes.size() && tries < 300; ++tries) {
        const ssize_t count = ::write(midi_, bytes.data() + sent, bytes.size() - sent);
        if (count > 0) sent += static_cast<std::size_t>(count);
        if (count <= 0) pause_ms(10);
    }
}

ByteVector Gadget::midi_until(const ByteVector& wanted) {
    ByteVector all;
    for (int i = 0; i < 60; ++i) {
        const ByteVector part = read_within(midi_, 50);
        all.insert(all.end(), part.begin(), part.end());
        if (std::search(all.begin(), all.end(), wanted.begin(), wanted.end()) != all.end()) break;
    }
    return all;
}

ByteVector Gadget::midi_within(int ms) {
    ByteVector all;
    for (int waited = 0; waited < ms; waited += 50) {
        const ByteVector part = read_within(midi_, 50);
        all.insert(all.end(), part.begin(), part.end());
    }
    return all;
}

void Gadget::send_report(const ByteVector& report) {
    for (int i = 0; i < 300; ++i) {
        if (::write(hid_, report.data(), report.size()) == static_cast<ssize_t>(report.size())) return;
        pause_ms(10);
    }
    std::perror("report");
}

ByteVector Gadget::output_report() {
    return read_within(hid_, 3000);
}

UhidDevice::UhidDevice(const char* name, const char* serial, std::uint32_t vendor, std::uint32_t product,
                       const ByteVector& descriptor)
    : fd_(::open("/dev/uhid", O_RDWR | O_CLOEXEC)) {
    if (fd_ < 0) throw std::runtime_error("cannot open /dev/uhid");
    uhid_event event{};
    event.type = UHID_CREATE2;
    std::snprintf(reinterpret_cast<char*>(event.u.create2.name), sizeof event.u.create2.name, "%s", name);
    std::snprintf(reinterpret_cast<char*>(event.u.create2.uniq), sizeof event.u.create2.uniq, "%s", serial);
    event.u.create2.bus = BUS_USB;
    event.u.create2.vendor = vendor;
    event.u.create2.product = product;
    event.u.create2.rd_size = static_cast<std::uint16_t>(descriptor.size());
    std::copy(descriptor.begin(), descriptor.end(), event.u.create2.rd_data);
    if (::write(fd_, &event, sizeof event) < 0) std::perror("uhid");
}

UhidDevice::~UhidDevice() {
    uhid_event event{};
    event.type = UHID_DESTROY;
    if (::write(fd_, &event, sizeof event) < 0) std::perror("uhid");
    ::close(fd_);
}

void UhidDevice::report(const ByteVector& bytes) {
    uhid_event event{};
    event.type = UHID_INPUT2;
    event.u.input2.size = static_cast<std::uint16_t>(bytes.size());
    std::copy(bytes.begin(), bytes.end(), event.u.input2.data);
    if (::write(fd_, &event, sizeof event) < 0) std::perror("uhid");
}

ByteVector UhidDevice::output() {
    for (int i = 0; i < 60; ++i) {
        pollfd state{fd_, POLLIN, 0};
        if (::poll(&state, 1, 50) <= 0) continue;
        uhid_event event{};
        if (::read(fd_, &event, sizeof event) <= 0 || event.type != UHID_OUTPUT) continue;
        return {event.u.output.data, event.u.output.data + event.u.output.size};
    }
    return {};
}

}  // namespace gonio::test
