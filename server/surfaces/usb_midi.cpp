#include <libusb.h>

#include <algorithm>
#include <array>
#include <deque>
#include <list>
#include <optional>
#include <utility>

#include "server/surfaces/wire.h"

namespace gonio {
namespace {

constexpr std::size_t kTransfers = 3;  // in flight: one is always waiting while another is looked at
constexpr std::int64_t kSendAgain_ns = 20'000'000, kSendFor_ns = 1'000'000'000;
constexpr std::int64_t kReap_ns = 1'000'000'000;  // for cancelled transfers to come back

// The MIDIStreaming interface of a device (USB MIDI 1.0: class 1, subclass 3), at alternate setting 0.
struct UsbMidiEndpoints {
    std::uint8_t interface = 0, in = 0, out = 0;  // endpoint addresses; out 0: none
    std::uint16_t packet_bytes = 64;
    bool interrupt = false;
};

std::optional<UsbMidiEndpoints> midi_endpoints(libusb_device* device) {
    libusb_config_descriptor* config = nullptr;
    if (libusb_get_active_config_descriptor(device, &config) != 0) return std::nullopt;
    std::optional<UsbMidiEndpoints> endpoints;
    for (int i = 0; i < config->bNumInterfaces && !endpoints; ++i) {
        for (int a = 0; a < config->interface[i].num_altsetting && !endpoints; ++a) {
            const libusb_interface_descriptor& setting = config->interface[i].altsetting[a];
            if (setting.bInterfaceClass != 1 || setting.bInterfaceSubClass != 3 || setting.bAlternateSetting != 0)
                continue;
            UsbMidiEndpoints found;
            found.interface = setting.bInterfaceNumber;
            for (int e = 0; e < setting.bNumEndpoints; ++e) {
                const libusb_endpoint_descriptor& endpoint = setting.endpoint[e];
                if ((endpoint.bEndpointAddress & LIBUSB_ENDPOINT_IN) == 0) {
                    if (found.out == 0) found.out = endpoint.bEndpointAddress;
                    continue;
                }
                if (found.in != 0) continue;
                found.in = endpoint.bEndpointAddress;
                found.packet_bytes = std::clamp<std::uint16_t>(endpoint.wMaxPacketSize & 0x7FF, 4, 1024);
                found.interrupt = (endpoint.bmAttributes & 3) == LIBUSB_TRANSFER_TYPE_INTERRUPT;
            }
            if (found.in != 0) endpoints = found;
        }
    }
    libusb_free_config_descriptor(config);
    return endpoints;
}

// "1-2.3", as sysfs names the device.
std::string port_of(libusb_device* device) {
    std::uint8_t ports[8];
    const int count = libusb_get_port_numbers(device, ports, sizeof ports);
    std::string port = std::to_string(libusb_get_bus_number(device));
    for (int i = 0; i < count; ++i) port += (i == 0 ? "-" : ".") + std::to_string(ports[i]);
    return port;
}

std::string path_of(libusb_device* device) {
    return "usb " + std::to_string(libusb_get_bus_number(device)) + ":" +
           std::to_string(libusb_get_device_address(device));
}

Error error_of(int code, const std::string& place) {
    if (code == LIBUSB_ERROR_ACCESS)
        return {"no_permission", place, "", "there is no permission to use it; docs/faders.md has the udev rules"};
    if (code == LIBUSB_ERROR_BUSY) return {"claimed", place, "", "another program owns it; close that program"};
    if (code == LIBUSB_ERROR_NO_DEVICE || code == LIBUSB_ERROR_NOT_FOUND)
        return {"vanished", place, "", "it is not there any more"};
    return {"device_failed", place, libusb_error_name(code), "it could not be opened"};
}

void add_pollfds(libusb_context* context, std::vector<pollfd>& fds) {
    const libusb_pollfd** const list = libusb_get_pollfds(context);
    for (const libusb_pollfd** one = list; one != nullptr && *one != nullptr; ++one)
        fds.push_back({(*one)->fd, (*one)->events, 0});
    libusb_free_pollfds(list);
}

class UsbMidiWire final : public Wire {
public:
    // Each wire has a libusb context of its own: a context lists only what was there when it began, unless udevd tells
    // it.
    UsbMidiWire(libusb_context* context, libusb_device_handle* handle, const UsbMidiEndpoints& endpoints,
                WireEvents events, std::list<UsbMidiWire*>& wires)
        : context_(context), handle_(handle), endpoints_(endpoints), events_(std::move(events)), wires_(wires) {
        wires_.push_back(this);
        for (std::size_t i = 0; i < kTransfers; ++i) {
            buffers_[i].resize(endpoints.packet_bytes);
            transfers_[i] = libusb_alloc_transfer(0);
            fill(transfers_[i], endpoints.in, buffers_[i], &UsbMidiWire::arrived);
        }
        out_ = libusb_alloc_transfer(0);
    }
    // Result: 0 or a libusb error.
    int begin() {
        for (libusb_transfer* transfer : transfers_) {
            if (const int code = libusb_submit_transfer(transfer); code != 0) return code;
            ++in_flight_;
        }
        return 0;
    }
    ~UsbMidiWire() override {
        wires_.remove(this);
        closing_ = true;
        for (libusb_transfer* transfer : transfers_) libusb_cancel_transfer(transfer);
        if (sending_) libusb_cancel_transfer(out_);
        const std::int64_t until_ns = monotonic_ns() + kReap_ns;
        while (in_flight_ > 0 && monotonic_ns() < until_ns) {
            timeval wait{0, 10'000};
            libusb_handle_events_timeout_completed(context_, &wait, nullptr);
        }
        libusb_release_interface(handle_, endpoints_.interface);
        if (in_flight_ > 0)
            return;  // freeing what libusb still holds would abort: a leak of a few hundred bytes is better
        for (libusb_transfer* transfer : transfers_) libusb_free_transfer(transfer);
        libusb_free_transfer(out_);
        libusb_close(handle_);
        libusb_exit(context_);
    }
    bool write(std::uint8_t cable, Bytes bytes) override {
        if (gone_ || endpoints_.out == 0) return false;
        const std::vector<std::uint8_t> packets = usb_midi_packets(cable, bytes);
        if (unsent_.size() + packets.size() > kMaxUnsent) return false;
        unsent_.insert(unsent_.end(), packets.begin(), packets.end());
        send();
        return true;
    }
    bool lost() override { return std::exchange(lost_, false); }
    // Result: when serve() has something to do though nothing came; 0: never.
    std::int64_t due_ns() const { return unsent_.empty() || sending_ ? 0 : again_ns_; }
    void watch(std::vector<pollfd>& fds) const { add_pollfds(context_, fds); }
    void serve() {
        timeval none{0, 0};
        libusb_handle_events_timeout_completed(context_, &none, nullptr);
        if (!gone_) send();
        if (gone_ && !std::exchange(told_, true)) events_.gone("it was unplugged");
    }

private:
    void fill(libusb_transfer* transfer, std::uint8_t endpoint, std::vector<std::uint8_t>& buffer,
              libusb_transfer_cb_fn done) {
        libusb_fill_bulk_transfer(transfer, handle_, endpoint, buffer.data(), static_cast<int>(buffer.size()), done,
                                  this, 0);
        if (endpoints_.interrupt) transfer->type = LIBUSB_TRANSFER_TYPE_INTERRUPT;
    }
    static void LIBUSB_CALL arrived(libusb_transfer* transfer) {
        auto& wire = *static_cast<UsbMidiWire*>(transfer->user_data);
        bool again = transfer->status == LIBUSB_TRANSFER_COMPLETED || transfer->status == LIBUSB_TRANSFER_TIMED_OUT;
        if (transfer->status == LIBUSB_TRANSFER_COMPLETED && transfer->actual_length > 0 && !wire.closing_) {
            std::vector<MidiMessage> messages;
            const std::size_t bad = read_usb_midi({transfer->buffer, static_cast<std::size_t>(transfer->actual_length)},
                                                  messages, &wire.system_);
            wire.events_.midi(messages, bad, monotonic_ns());
            if (MidiNews news = wire.system_.take_news(); !news.empty())
                wire.events_.system(std::move(news), monotonic_ns());
        }
        if (transfer->status == LIBUSB_TRANSFER_STALL && !wire.closing_)
            again = libusb_clear_halt(wire.handle_, transfer->endpoint) == 0;
        if (again && !wire.closing_ && libusb_submit_transfer(transfer) == 0) return;
        --wire.in_flight_;
        // NO_DEVICE and ERROR come before the system says that the device has left, and both must do.
        if (!wire.closing_) wire.gone_ = true;
    }
    static void LIBUSB_CALL sent(libusb_transfer* transfer) {
        auto& wire = *static_cast<UsbMidiWire*>(transfer->user_data);
        --wire.in_flight_;
        wire.sending_ = false;
        if (transfer->status == LIBUSB_TRANSFER_NO_DEVICE) wire.gone_ = true;
        if (transfer->status == LIBUSB_TRANSFER_COMPLETED) {
            wire.unsent_.erase(wire.unsent_.begin(), wire.unsent_.begin() + transfer->length);
            wire.failing_since_ns_ = wire.again_ns_ = 0;
        } else {
            if (transfer->status == LIBUSB_TRANSFER_STALL && !wire.closing_)
                libusb_clear_halt(wire.handle_, transfer->endpoint);
            wire.not_sent();
        }
        if (!wire.closing_ && !wire.gone_) wire.send();
    }
    // What is not taken is sent again for a while, then forgotten, and the surface is painted anew.
    void not_sent() {
        const std::int64_t now_ns = monotonic_ns();
        if (failing_since_ns_ == 0) failing_since_ns_ = now_ns;
        again_ns_ = now_ns + kSendAgain_ns;
        if (now_ns - failing_since_ns_ < kSendFor_ns) return;
        failing_since_ns_ = 0;
        lost_ = true;
        unsent_.clear();
    }
    void send() {
        if (sending_ || unsent_.empty() || monotonic_ns() < again_ns_) return;
        const std::size_t most = std::max<std::size_t>(4, std::min<std::size_t>(64, endpoints_.packet_bytes) / 4 * 4);
        const std::size_t count = std::min(most, unsent_.size());
        out_buffer_.assign(unsent_.begin(), unsent_.begin() + static_cast<std::ptrdiff_t>(count));
        fill(out_, endpoints_.out, out_buffer_, &UsbMidiWire::sent);
        if (libusb_submit_transfer(out_) != 0) return not_sent();  // serve() tries again
        sending_ = true;
        ++in_flight_;
    }

    libusb_context* context_;
    libusb_device_handle* handle_;
    UsbMidiEndpoints endpoints_;
    MidiSystem system_;
    WireEvents events_;
    std::list<UsbMidiWire*>& wires_;
    std::array<libusb_transfer*, kTransfers> transfers_{};
    std::array<std::vector<std::uint8_t>, kTransfers> buffers_;
    libusb_transfer* out_ = nullptr;
    std::vector<std::uint8_t> out_buffer_;
    std::deque<std::uint8_t> unsent_;
    int in_flight_ = 0;
    std::int64_t failing_since_ns_ = 0, again_ns_ = 0;  // of what is sent next; 0: it does not fail
    bool sending_ = false, lost_ = false, gone_ = false, told_ = false, closing_ = false;
};

class UsbMidiBackend final : public Backend {
public:
    explicit UsbMidiBackend(std::vector<std::string> owned) : owned_(std::move(owned)) {}
    ~UsbMidiBackend() override {
        if (monitor_ == nullptr) return;
        if (monitoring_) libusb_hotplug_deregister_callback(monitor_, callback_);
        libusb_exit(monitor_);
    }

    std::vector<FoundSurface> scan() override {
        begin_monitor();
        std::vector<std::string> nodes = nodes_in("/sys/bus/usb/devices", "devnum");
        if (nodes == nodes_) return last_;
        nodes_ = std::move(nodes);
        std::vector<FoundSurface> surfaces;
        libusb_context* context = nullptr;
        if (libusb_init(&context) != 0) {  // no USB on this machine, or not yet
            nodes_.reset();
            return last_;
        }
        libusb_device** list = nullptr;
        const ssize_t count = libusb_get_device_list(context, &list);
        for (ssize_t i = 0; i < count; ++i) {
            libusb_device_descriptor descriptor{};
            if (libusb_get_device_descriptor(list[i], &descriptor) != 0 || !midi_endpoints(list[i])) continue;
            FoundSurface surface;
            surface.path = path_of(list[i]);
            surface.transport = "usb-midi";
            surface.vendor_id = descriptor.idVendor;
            surface.product_id = descriptor.idProduct;
            const std::string port = port_of(list[i]), folder = "/sys/bus/usb/devices/" + port;
            surface.product = small_file(folder + "/product");  // the device itself cannot be asked without permission
            surface.identity =
                surface_identity(descriptor.idVendor, descriptor.idProduct, small_file(folder + "/serial"), port);
            const std::string id = surface_identity(descriptor.idVendor, descriptor.idProduct, "", "");
            surface.owned = std::find(owned_.begin(), owned_.end(), id) != owned_.end();
            surfaces.push_back(std::move(surface));
        }
        if (list != nullptr) libusb_free_device_list(list, 1);
        libusb_exit(context);
        return last_ = surfaces;
    }

    Result<std::unique_ptr<Wire>> open(const FoundSurface& surface, WireEvents events) override {
        libusb_context* context = nullptr;
        if (const int code = libusb_init(&context); code != 0) return error_of(code, surface.path);
        libusb_device** list = nullptr;
        const ssize_t count = libusb_get_device_list(context, &list);
        libusb_device_handle* handle = nullptr;
        std::optional<UsbMidiEndpoints> endpoints;
        int code = LIBUSB_ERROR_NO_DEVICE;
        for (ssize_t i = 0; i < count && handle == nullptr; ++i) {
            if (path_of(list[i]) != surface.path) continue;
            endpoints = midi_endpoints(list[i]);
            code = endpoints ? libusb_open(list[i], &handle) : LIBUSB_ERROR_NOT_FOUND;
        }
        if (list != nullptr) libusb_free_device_list(list, 1);
        if (code == 0) {
            libusb_set_auto_detach_kernel_driver(handle, 1);
            code = libusb_claim_interface(handle, endpoints->interface);
            if (code != 0) libusb_close(handle);
        }
        if (code != 0) {
            libusb_exit(context);
            return error_of(code, surface.path);
        }
        auto wire = std::make_unique<UsbMidiWire>(context, handle, *endpoints, std::move(events), wires_);
        if (code = wire->begin(); code != 0) return error_of(code, surface.path);
        return std::unique_ptr<Wire>(std::move(wire));
    }

    void watch(std::vector<pollfd>& fds) const override {
        for (const UsbMidiWire* wire : wires_) wire->watch(fds);
        if (monitor_ != nullptr) add_pollfds(monitor_, fds);
    }
    std::int64_t due_ns() const override {
        std::int64_t due = 0;
        for (const UsbMidiWire* wire : wires_)
            if (const std::int64_t own = wire->due_ns(); own != 0 && (due == 0 || own < due)) due = own;
        return due;
    }
    void serve() override {
        for (UsbMidiWire* wire : std::list<UsbMidiWire*>(wires_)) wire->serve();
        timeval none{0, 0};
        if (monitor_ != nullptr) libusb_handle_events_timeout_completed(monitor_, &none, nullptr);
    }
    bool changed() override { return std::exchange(changed_, false); }

private:
    // With udevd running libusb tells at once; without it the comparison of lists below has to do.
    void begin_monitor() {
        if (monitor_ != nullptr || libusb_init(&monitor_) != 0) return;
        if (libusb_has_capability(LIBUSB_CAP_HAS_HOTPLUG) == 0) return;
        monitoring_ = libusb_hotplug_register_callback(
                          monitor_,
                          static_cast<libusb_hotplug_event>(LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED |
                                                            LIBUSB_HOTPLUG_EVENT_DEVICE_LEFT),
                          static_cast<libusb_hotplug_flag>(0), LIBUSB_HOTPLUG_MATCH_ANY, LIBUSB_HOTPLUG_MATCH_ANY,
                          LIBUSB_HOTPLUG_MATCH_ANY,
                          [](libusb_context*, libusb_device*, libusb_hotplug_event, void* self) {
                              static_cast<UsbMidiBackend*>(self)->changed_ = true;  // nothing may be opened in here
                              return 0;
                          },
                          this, &callback_) == 0;
    }

    std::vector<std::string> owned_;
    std::list<UsbMidiWire*> wires_;
    libusb_context* monitor_ = nullptr;
    libusb_hotplug_callback_handle callback_ = 0;
    bool monitoring_ = false, changed_ = false;
    std::optional<std::vector<std::string>> nodes_;  // of the last scan
    std::vector<FoundSurface> last_;                 // that it found
};

}  // namespace

std::unique_ptr<Backend> make_usb_midi_backend(std::vector<std::string> owned) {
    return std::make_unique<UsbMidiBackend>(std::move(owned));
}

}  // namespace gonio
