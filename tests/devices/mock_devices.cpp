#include "tests/devices/mock_devices.h"

#include <fcntl.h>
#include <linux/hidraw.h>
#include <linux/usbdevice_fs.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <thread>
#include <utility>

namespace gonio::test {
namespace {

void pause_ms(int ms) {
    std::this_thread::sleep_for(std::chrono::milliseconds(ms));
}

const ByteVector kHidDescriptor = {0x05, 0x01, 0x09, 0x04, 0xA1, 0x01, 0x85, 0x01, 0x05, 0x01, 0x09, 0x36, 0x09, 0x36,
                                   0x09, 0x36, 0x09, 0x36, 0x09, 0x36, 0x09, 0x36, 0x09, 0x36, 0x09, 0x36, 0x15, 0x00,
                                   0x26, 0xFF, 0x03, 0x75, 0x10, 0x95, 0x08, 0x81, 0x02, 0x05, 0x09, 0x19, 0x01, 0x29,
                                   0x10, 0x15, 0x00, 0x25, 0x01, 0x75, 0x01, 0x95, 0x10, 0x81, 0x02, 0x85, 0x02, 0x05,
                                   0x08, 0x19, 0x01, 0x29, 0x10, 0x75, 0x01, 0x95, 0x10, 0x91, 0x02, 0xC0};

std::string hex(const ByteVector& bytes) {
    std::string text;
    char two[4];
    for (const std::uint8_t byte : bytes) {
        std::snprintf(two, sizeof two, "%02X", byte);
        text += two;
    }
    return text;
}

gboolean on_hid_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer) {
    const gulong request = umockdev_ioctl_client_get_request(client);
    UMockdevIoctlData* argument = umockdev_ioctl_client_get_arg(client);
    if (request == HIDIOCGRDESCSIZE) {
        UMockdevIoctlData* size = umockdev_ioctl_data_resolve(argument, 0, sizeof(int), nullptr);
        *reinterpret_cast<int*>(size->data) = static_cast<int>(kHidDescriptor.size());
        umockdev_ioctl_data_unref(size);
        umockdev_ioctl_client_complete(client, 0, 0);
        return TRUE;
    }
    if (request == HIDIOCGRDESC) {
        UMockdevIoctlData* data = umockdev_ioctl_data_resolve(argument, 0, sizeof(hidraw_report_descriptor), nullptr);
        auto* descriptor = reinterpret_cast<hidraw_report_descriptor*>(data->data);
        descriptor->size = static_cast<std::uint32_t>(kHidDescriptor.size());
        std::copy(kHidDescriptor.begin(), kHidDescriptor.end(), descriptor->value);
        umockdev_ioctl_data_unref(data);
        umockdev_ioctl_client_complete(client, 0, 0);
        return TRUE;
    }
    return FALSE;
}

void add(UMockdevTestbed* testbed, const std::string& text) {
    GError* error = nullptr;
    if (!umockdev_testbed_add_from_string(testbed, text.c_str(), &error))
        std::fprintf(stderr, "umockdev: %s\n", error->message);
}

constexpr const char* kUsbPath = "/sys/devices/pci0/usb1/1-2";

}  // namespace

// The four levels of sysfs; without the `device` link hidapi finds no report descriptor. umockdev keeps traces of a
// node that it has removed, so each plugging has nodes of its own, as with a kernel.
void MockHid::plug() {
    const std::string n = std::to_string(plugged_++), parent = "/devices/pci0/usb1/1-3/1-3:1.0/0003:1209:0001.000" + n;
    std::string usb;
    if (plugged_ == 1)
        usb =
            "P: /devices/pci0/usb1/1-3/1-3:1.0\nE: DEVTYPE=usb_interface\nE: DRIVER=usbhid\nE: PRODUCT=1209/1/100\nE: "
            "INTERFACE=3/0/0\nE: SUBSYSTEM=usb\nA: bInterfaceClass=03\\n\nA: bInterfaceNumber=00\\n\n\n"
            "P: /devices/pci0/usb1/1-3\nE: DEVTYPE=usb_device\nE: DRIVER=usb\nE: PRODUCT=1209/1/100\nE: "
            "SUBSYSTEM=usb\nA: "
            "idVendor=1209\\n\nA: idProduct=0001\\n\nA: bcdDevice=0100\\n\nA: manufacturer=Acme\\n\nA: "
            "product=FaderBox "
            "8\\n\nA: serial=SN0042\\n\n\n";
    add(testbed_,
        "P: " + parent + "/hidraw/hidraw" + n + "\nN: hidraw" + n + "\nE: DEVNAME=/dev/hidraw" + n +
            "\nE: MAJOR=240\nE: MINOR=" + n + "\nE: SUBSYSTEM=hidraw\nA: dev=240:" + n +
            "\\n\nL: device=../../../0003:1209:0001.000" + n + "\n\nP: " + parent +
            "\nE: DRIVER=hid-generic\nE: HID_ID=0003:00001209:00000001\nE: HID_NAME=Acme FaderBox 8\nE: "
            "HID_PHYS=usb-0000:00:01.0-3/input0\nE: HID_UNIQ=SN0042\nE: SUBSYSTEM=hid\nH: report_descriptor=" +
            hex(kHidDescriptor) + "\n\n" + usb);
    node_ = "/dev/hidraw" + n;
    handler_ = umockdev_ioctl_base_new();
    g_signal_connect(handler_, "handle-ioctl", G_CALLBACK(on_hid_ioctl), nullptr);
    umockdev_testbed_attach_ioctl(testbed_, node_.c_str(), handler_, nullptr);
    master_ = umockdev_testbed_get_dev_fd(testbed_, node_.c_str());
}

void MockHid::unplug() {
    umockdev_testbed_detach_ioctl(testbed_, node_.c_str(), nullptr);
    g_clear_object(&handler_);
    ::close(master_);  // reading fails, and so does opening
    // umockdev 0.17 stumbles over a pseudo terminal whose number comes a second time: keep it, once it is free.
    pause_ms(300);
    [[maybe_unused]] const int kept = ::posix_openpt(O_RDWR | O_NOCTTY);
    master_ = -1;
}

void MockHid::report(const ByteVector& bytes) {
    if (::write(master_, bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size())) std::perror("report");
    pause_ms(3);
}

ByteVector MockHid::output() {
    for (int i = 0; i < 2000; ++i) {
        pollfd state{master_, POLLIN, 0};
        if (::poll(&state, 1, 1) <= 0 || (state.revents & POLLIN) == 0) continue;
        ByteVector bytes(64);
        const ssize_t count = ::read(master_, bytes.data(), bytes.size());
        if (count <= 0) continue;  // EIO until the other side is open
        bytes.resize(static_cast<std::size_t>(count));
        return bytes;
    }
    return {};
}

MockUsbMidi::MockUsbMidi(UMockdevTestbed* testbed) : testbed_(testbed), handler_(umockdev_ioctl_base_new()) {
    g_signal_connect(handler_, "handle-ioctl", G_CALLBACK(&MockUsbMidi::on_ioctl), this);
}

MockUsbMidi::~MockUsbMidi() {
    g_object_unref(handler_);
}

void MockUsbMidi::plug() {
    removed_ = detached_ = false;
    ByteVector descriptors = {
        18, 1, 0x00, 0x02, 0,  0, 0, 64,   0x44, 0x09, 0x17, 0x01, 0x00, 0x01, 1, 2, 0, 1,  // device 0944:0117
        9,  2, 0,    0,    2,  1, 0, 0x80, 50,                                              // configuration
        9,  4, 0,    0,    0,  1, 1, 0,    0,    9,    0x24, 1,    0x00, 0x01, 9, 0, 1, 1,  // AudioControl
        9,  4, 1,    0,    2,  1, 3, 0,    0,    7,    0x24, 1,    0x00, 0x01, 7, 0,        // MIDIStreaming
        9,  5, 0x02, 2,    64, 0, 0, 0,    0,    9,    5,    0x81, 2,    64,   0, 0, 0, 0};
    descriptors[20] = static_cast<std::uint8_t>(descriptors.size() - 18);
    umockdev_testbed_attach_ioctl(testbed_, "/dev/bus/usb/001/002", handler_, nullptr);
    // Without DEVNAME libusb drops the event without a word.
    add(testbed_,
        "P: /devices/pci0/usb1/1-2\nN: bus/usb/001/002\nE: DEVNAME=/dev/bus/usb/001/002\nE: DEVTYPE=usb_device\nE: "
        "DRIVER=usb\nE: SUBSYSTEM=usb\nE: BUSNUM=001\nE: DEVNUM=002\nE: PRODUCT=944/117/100\nE: MAJOR=189\nE: "
        "MINOR=1\nA: "
        "busnum=1\\n\nA: devnum=2\\n\nA: speed=12\\n\nA: bConfigurationValue=1\\n\nA: idVendor=0944\\n\nA: "
        "idProduct=0117\\n\nA: "
        "product=nanoKONTROL2\\n\nA: dev=189:1\\n\nH: descriptors=" +
            hex(descriptors) + "\n\n");
}

void MockUsbMidi::unplug() {
    removed_ = true;
    umockdev_testbed_uevent(testbed_, kUsbPath, "remove");  // afterwards the event would have no DEVNAME
    pause_ms(200);
    umockdev_testbed_remove_device(testbed_, kUsbPath);
    umockdev_testbed_detach_ioctl(testbed_, "/dev/bus/usb/001/002", nullptr);
    const std::lock_guard lock(mutex_);
    inputs_.clear();
    ready_.clear();
    to_host_.clear();
}

void MockUsbMidi::packets(const ByteVector& bytes) {
    const std::lock_guard lock(mutex_);
    to_host_.insert(to_host_.end(), bytes.begin(), bytes.end());
    complete_inputs();
}

ByteVector MockUsbMidi::output() {
    for (int i = 0; i < 2000; ++i) {
        {
            const std::lock_guard lock(mutex_);
            if (!from_host_.empty()) return std::exchange(from_host_, {});
        }
        pause_ms(1);
    }
    return {};
}

void MockUsbMidi::complete_inputs() {
    while (!to_host_.empty() && !inputs_.empty()) {
        UMockdevIoctlData* data = inputs_.front();
        inputs_.erase(inputs_.begin());
        auto* urb = reinterpret_cast<usbdevfs_urb*>(data->data);
        const std::size_t count =
            std::min({to_host_.size(), std::size_t{64}, static_cast<std::size_t>(urb->buffer_length)});
        UMockdevIoctlData* buffer = umockdev_ioctl_data_resolve(data, G_STRUCT_OFFSET(usbdevfs_urb, buffer),
                                                                static_cast<gsize>(urb->buffer_length), nullptr);
        std::memcpy(buffer->data, to_host_.data(), count);
        umockdev_ioctl_data_unref(buffer);
        to_host_.erase(to_host_.begin(), to_host_.begin() + static_cast<std::ptrdiff_t>(count));
        urb->actual_length = static_cast<int>(count);
        urb->status = 0;
        ready_.push_back(data);
    }
}

void MockUsbMidi::submit(UMockdevIoctlClient* client, UMockdevIoctlData* argument) {
    UMockdevIoctlData* data = umockdev_ioctl_data_resolve(argument, 0, sizeof(usbdevfs_urb), nullptr);
    auto* urb = reinterpret_cast<usbdevfs_urb*>(data->data);
    UMockdevIoctlData* buffer = umockdev_ioctl_data_resolve(data, G_STRUCT_OFFSET(usbdevfs_urb, buffer),
                                                            static_cast<gsize>(urb->buffer_length), nullptr);
    if (urb->type == USBDEVFS_URB_TYPE_CONTROL) {
        urb->status = -EPIPE;
        ready_.push_back(data);
    } else if ((urb->endpoint & 0x80) != 0) {
        inputs_.push_back(data);
        most_in_flight_ = std::max(most_in_flight_, inputs_.size());
        complete_inputs();
    } else {
        const auto* bytes = reinterpret_cast<const std::uint8_t*>(buffer->data);
        from_host_.insert(from_host_.end(), bytes, bytes + urb->buffer_length);
        urb->actual_length = urb->buffer_length;
        urb->status = 0;
        ready_.push_back(data);
    }
    umockdev_ioctl_data_unref(buffer);
    umockdev_ioctl_client_complete(client, 0, 0);
}

void MockUsbMidi::reap(UMockdevIoctlClient* client, UMockdevIoctlData* argument) {
    if (removed_) return umockdev_ioctl_client_complete(client, -1, ENODEV);
    if (ready_.empty()) return umockdev_ioctl_client_complete(client, -1, EAGAIN);
    UMockdevIoctlData* data = ready_.front();
    ready_.erase(ready_.begin());
    UMockdevIoctlData* pointer = umockdev_ioctl_data_resolve(argument, 0, sizeof(gpointer), nullptr);
    umockdev_ioctl_data_set_ptr(pointer, 0, data);
    umockdev_ioctl_data_unref(pointer);
    umockdev_ioctl_data_unref(data);
    umockdev_ioctl_client_complete(client, 0, 0);
}

bool MockUsbMidi::handle(UMockdevIoctlClient* client) {
    const gulong request = umockdev_ioctl_client_get_request(client);
    UMockdevIoctlData* argument = umockdev_ioctl_client_get_arg(client);
    const std::lock_guard lock(mutex_);
    switch (request) {
        case USBDEVFS_GET_CAPABILITIES: {
            UMockdevIoctlData* data = umockdev_ioctl_data_resolve(argument, 0, 4, nullptr);
            *reinterpret_cast<std::uint32_t*>(data->data) = USBDEVFS_CAP_ZERO_PACKET | USBDEVFS_CAP_BULK_CONTINUATION |
                                                            USBDEVFS_CAP_NO_PACKET_SIZE_LIM |
                                                            USBDEVFS_CAP_REAP_AFTER_DISCONNECT;
            umockdev_ioctl_data_unref(data);
            umockdev_ioctl_client_complete(client, 0, 0);
            return true;
        }
        case USBDEVFS_GETDRIVER: {
            UMockdevIoctlData* data = umockdev_ioctl_data_resolve(argument, 0, sizeof(usbdevfs_getdriver), nullptr);
            std::strcpy(reinterpret_cast<usbdevfs_getdriver*>(data->data)->driver, "snd-usb-audio");
            umockdev_ioctl_data_unref(data);
            umockdev_ioctl_client_complete(client, 0, 0);
            return true;
        }
        case USBDEVFS_DISCONNECT_CLAIM:
        case USBDEVFS_CLAIMINTERFACE: {
            const int error = claim_error_;
            detached_ = detached_ || (request == USBDEVFS_DISCONNECT_CLAIM && error == 0);
            umockdev_ioctl_client_complete(client, error == 0 ? 0 : -1, error);
            return true;
        }
        case USBDEVFS_SUBMITURB:
            submit(client, argument);
            return true;
        case USBDEVFS_REAPURB:
        case USBDEVFS_REAPURBNDELAY:
            reap(client, argument);
            return true;
        case USBDEVFS_DISCARDURB: {
            if (!inputs_.empty()) {
                reinterpret_cast<usbdevfs_urb*>(inputs_.front()->data)->status = -ENOENT;
                ready_.push_back(inputs_.front());
                inputs_.erase(inputs_.begin());
            }
            umockdev_ioctl_client_complete(client, 0, 0);
            return true;
        }
        default:
            umockdev_ioctl_client_complete(client, 0, 0);
            return true;
    }
}

gboolean MockUsbMidi::on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
    return static_cast<MockUsbMidi*>(self)->handle(client) ? TRUE : FALSE;
}

}  // namespace gonio::test
