#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <list>
#include <utility>

#include "server/base/descriptor.h"
#include "server/surfaces/wire.h"

namespace gonio {
namespace {

class AlsaWire final : public Wire {
public:
    AlsaWire(Descriptor port, WireEvents events, std::list<AlsaWire*>& wires)
        : port_(std::move(port)), events_(std::move(events)), wires_(wires) {
        wires_.push_back(this);
    }
    ~AlsaWire() override { wires_.remove(this); }
    bool write(std::uint8_t, Bytes bytes) override {
        if (gone_ || unsent_.size() + bytes.size() > kMaxUnsent) return false;
        unsent_.insert(unsent_.end(), bytes.begin(), bytes.end());
        flush();
        return true;
    }
    pollfd watch() const { return {port_.fd(), static_cast<short>(unsent_.empty() ? POLLIN : POLLIN | POLLOUT), 0}; }
    void serve() {
        std::uint8_t buffer[1024];
        for (ssize_t count = 1; count > 0 && !gone_;) {
            count = ::read(port_.fd(), buffer, sizeof buffer);
            if (count < 0) gone_ = errno != EAGAIN && errno != EINTR;
            if (count <= 0) break;
            std::vector<MidiMessage> messages;
            const std::size_t bad = stream_.take({buffer, static_cast<std::size_t>(count)}, messages);
            events_.midi(messages, bad, monotonic_ns());
            if (MidiNews news = stream_.take_news(); !news.empty()) events_.system(std::move(news), monotonic_ns());
        }
        flush();
        pollfd state{port_.fd(), 0, 0};
        if (!gone_ && ::poll(&state, 1, 0) > 0) gone_ = (state.revents & (POLLERR | POLLHUP | POLLNVAL)) != 0;
        if (gone_ && !std::exchange(told_, true)) events_.gone("it was unplugged");
    }

private:
    void flush() {
        while (!unsent_.empty() && !gone_) {
            const ssize_t count = ::write(port_.fd(), unsent_.data(), unsent_.size());
            if (count < 0) gone_ = errno != EAGAIN && errno != EINTR;
            if (count <= 0) return;
            unsent_.erase(unsent_.begin(), unsent_.begin() + count);
        }
    }
    Descriptor port_;
    WireEvents events_;
    std::list<AlsaWire*>& wires_;
    MidiStream stream_;
    std::vector<std::uint8_t> unsent_;
    bool gone_ = false, told_ = false;
};

class AlsaBackend final : public Backend {
public:
    explicit AlsaBackend(std::vector<std::string> owned) : owned_(std::move(owned)) {}

    std::vector<FoundSurface> scan() override {
        std::vector<FoundSurface> surfaces;
        std::error_code error;
        for (const auto& entry : std::filesystem::directory_iterator("/dev/snd", error)) {
            const std::string name = entry.path().filename().string();
            unsigned card = 0, device = 0;
            if (std::sscanf(name.c_str(), "midiC%uD%u", &card, &device) != 2) continue;
            const std::string folder = "/proc/asound/card" + std::to_string(card);
            FoundSurface surface;
            surface.path = "alsa " + entry.path().string();
            surface.transport = "alsa-midi";
            surface.product = small_file(folder + "/midi" + std::to_string(device));
            surface.product = surface.product.substr(0, surface.product.find('\n'));
            unsigned vendor = 0, product = 0;
            const std::string id = small_file(folder + "/usbid");
            if (std::sscanf(id.c_str(), "%4x:%4x", &vendor, &product) == 2) {
                const std::string port = usb_port_of("/sys/class/sound/card" + std::to_string(card) + "/device");
                surface.vendor_id = static_cast<std::uint16_t>(vendor);
                surface.product_id = static_cast<std::uint16_t>(product);
                surface.identity = surface_identity(surface.vendor_id, surface.product_id,
                                                    small_file("/sys/bus/usb/devices/" + port + "/serial"), port);
                if (device > 0) surface.identity += "/" + std::to_string(device);  // each port of a surface for itself
                surface.owned = std::find(owned_.begin(), owned_.end(), id) != owned_.end();
            } else {
                surface.identity = "alsa:" + small_file(folder + "/id") + "." + std::to_string(device);
            }
            surfaces.push_back(std::move(surface));
        }
        return surfaces;
    }

    Result<std::unique_ptr<Wire>> open(const FoundSurface& surface, WireEvents events) override {
        const std::string path = surface.path.substr(5);
        Descriptor port;
        for (const int direction : {O_RDWR, O_RDONLY}) {  // some ports only speak
            port = Descriptor(::open(path.c_str(), direction | O_NONBLOCK | O_CLOEXEC));
            if (port || errno == EACCES || errno == EBUSY) break;
        }
        if (!port && (errno == EACCES || errno == EPERM))
            return Error{"no_permission", path, "",
                         "there is no permission to use it; its user must be in the group audio"};
        if (!port && (errno == EBUSY || errno == EAGAIN))
            return Error{"claimed", path, "", "another program owns it; close that program"};
        if (!port) return Error{"vanished", path, "", "it is not there any more"};
        return std::unique_ptr<Wire>(std::make_unique<AlsaWire>(std::move(port), std::move(events), wires_));
    }

    void watch(std::vector<pollfd>& fds) const override {
        for (const AlsaWire* wire : wires_) fds.push_back(wire->watch());
    }
    void serve() override {
        for (AlsaWire* wire : std::list<AlsaWire*>(wires_)) wire->serve();
    }

private:
    std::vector<std::string> owned_;
    std::list<AlsaWire*> wires_;
};

}  // namespace

std::unique_ptr<Backend> make_alsa_midi_backend(std::vector<std::string> owned) {
    return std::make_unique<AlsaBackend>(std::move(owned));
}

}  // namespace gonio
