#include <fcntl.h>
#include <hidapi.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <thread>

#include "protocol/surface/hid_surface.h"
#include "server/base/bounded_file.h"
#include "server/base/queue.h"
#include "server/surfaces/wire.h"

namespace gonio {
namespace {

constexpr std::size_t kMaxReport = 4097;   // with its id
constexpr std::size_t kMaxReports = 4096;  // read and not yet taken; later ones are lost
constexpr std::size_t kMaxWrites = 256;    // not yet written; later ones are refused
constexpr int kReadTimeoutMs = 20;         // as long may a write wait

struct FromDevice {
    std::uint32_t id = 0;
    std::vector<std::uint8_t> report;  // empty: gone
    std::int64_t t_ns = 0;
};

// Wide text of hidapi as UTF-8, characters beyond ASCII as '?'.
std::string narrow(const wchar_t* text) {
    std::string result;
    for (; text != nullptr && *text != 0 && result.size() < 128; ++text)
        result += *text >= 0x20 && *text < 0x7F ? static_cast<char>(*text) : '?';
    return result;
}

class HidWire final : public Wire {
public:
    // The device's entry in `events` goes with the wire: what its thread has said last then reaches nobody.
    HidWire(hid_device* device, std::uint32_t id, std::map<std::uint32_t, WireEvents>& events, Queue<FromDevice>& out,
            std::function<void()> wake)
        : device_(device),
          id_(id),
          events_(events),
          out_(out),
          wake_(std::move(wake)),
          writes_(kMaxWrites),
          thread_([this] { run(); }) {}
    ~HidWire() override {
        stop_ = true;
        thread_.join();
        hid_close(device_);
        events_.erase(id_);
    }
    bool write(std::uint8_t, Bytes bytes) override {
        return writes_.push(std::vector<std::uint8_t>(bytes.begin(), bytes.end()));
    }

private:
    void run() {
        std::vector<std::uint8_t> buffer(kMaxReport);
        while (!stop_) {
            const int count = hid_read_timeout(device_, buffer.data(), buffer.size(), kReadTimeoutMs);
            const std::int64_t t_ns = monotonic_ns();
            bool gone = count < 0;  // 0 is "nothing yet", also where the report was empty
            if (count > 0) {
                out_.push({id_, {buffer.begin(), buffer.begin() + count}, t_ns});
                wake_();
            }
            while (!gone) {
                const auto report = writes_.try_pop();
                if (!report) break;
                // EPIPE: the device does not want this one; it is still there.
                gone = hid_write(device_, report->data(), report->size()) < 0 && (errno == ENODEV || errno == EIO);
            }
            if (!gone) continue;
            while (!out_.push({id_, {}, t_ns}) && !stop_) std::this_thread::sleep_for(std::chrono::milliseconds(5));
            wake_();
            return;
        }
    }
    hid_device* device_;
    std::uint32_t id_;
    std::map<std::uint32_t, WireEvents>& events_;
    Queue<FromDevice>& out_;
    std::function<void()> wake_;
    Queue<std::vector<std::uint8_t>> writes_;
    std::atomic<bool> stop_{false};
    std::thread thread_;
};

class HidBackend final : public Backend {
public:
    HidBackend(std::vector<std::string> wanted, std::function<void()> wake)
        : wanted_(std::move(wanted)), wake_(std::move(wake)), reports_(kMaxReports) {
        hid_init();
    }
    ~HidBackend() override { hid_exit(); }

    std::vector<FoundSurface> scan() override {
        std::vector<FoundSurface> surfaces;
        // Permissions may come later than nodes, but open() asks for these.
        std::vector<std::string> nodes = nodes_in("/sys/class/hidraw", "dev");
        if (nodes == nodes_) return last_;
        nodes_ = std::move(nodes);
        hid_device_info* const list = hid_enumerate(0, 0);
        std::set<std::string> of_people;  // nodes that are a keyboard or a pointer as well
        for (const hid_device_info* info = list; info != nullptr; info = info->next)
            if (is_of_people(info->usage_page, info->usage)) of_people.insert(info->path);
        for (const hid_device_info* info = list; info != nullptr; info = info->next) {
            const std::string path = std::string("hid ") + info->path;
            const bool known = std::ranges::find(surfaces, path, &FoundSurface::path) != surfaces.end();
            const std::string id = surface_identity(info->vendor_id, info->product_id, "", "");
            const bool wanted = std::find(wanted_.begin(), wanted_.end(), id) != wanted_.end();
            if (known || (!wanted && !is_control_box(info->vendor_id, info->product_id, info->usage_page, info->usage,
                                                     of_people.contains(info->path))))
                continue;
            FoundSurface surface;
            surface.path = path;
            surface.transport = "hid";
            surface.vendor_id = info->vendor_id;
            surface.product_id = info->product_id;
            surface.product = narrow(info->product_string);
            const std::string folder =
                "/sys/class/hidraw/" + std::filesystem::path(info->path).filename().string() + "/device";
            surface.identity =
                surface_identity(info->vendor_id, info->product_id, narrow(info->serial_number), usb_port_of(folder));
            if (const auto descriptor = read_bounded_file(folder + "/report_descriptor", kMaxHidDescriptor))
                surface.descriptor.assign(descriptor->begin(), descriptor->end());
            surface.owned = true;
            surfaces.push_back(std::move(surface));
        }
        hid_free_enumeration(list);
        return last_ = surfaces;
    }

    Result<std::unique_ptr<Wire>> open(const FoundSurface& surface, WireEvents events) override {
        const std::string path = surface.path.substr(4);
        // hidapi's own words are "Unable to open": what the system says is clearer.
        const int fd = ::open(path.c_str(), O_RDWR | O_CLOEXEC | O_NONBLOCK);
        const int why = errno;
        if (fd >= 0) ::close(fd);
        if (fd < 0 && (why == EACCES || why == EPERM))
            return Error{"no_permission", path, "",
                         "there is no permission to use it; docs/faders.md has the udev rules"};
        if (fd < 0 && why == EBUSY) return Error{"claimed", path, "", "another program owns it; close that program"};
        if (fd < 0) return Error{"vanished", path, "", "it is not there any more"};
        hid_device* const device = hid_open_path(path.c_str());
        if (device == nullptr) return Error{"device_failed", path, "", "it could not be opened"};
        const std::uint32_t id = next_id_++;
        events_[id] = std::move(events);
        return std::unique_ptr<Wire>(std::make_unique<HidWire>(device, id, events_, reports_, wake_));
    }

    void serve() override {
        while (auto from = reports_.try_pop()) {
            const auto found = events_.find(from->id);
            if (found == events_.end()) continue;
            if (!from->report.empty()) {
                found->second.report(from->report, from->t_ns);
                continue;
            }
            nodes_.reset();
            found->second.gone("it was unplugged");
        }
    }

private:
    std::vector<std::string> wanted_;
    std::function<void()> wake_;
    Queue<FromDevice> reports_;
    std::map<std::uint32_t, WireEvents> events_;
    std::uint32_t next_id_ = 1;
    std::optional<std::vector<std::string>> nodes_;  // of the last scan
    std::vector<FoundSurface> last_;                 // that it found
};

}  // namespace

std::unique_ptr<Backend> make_hid_backend(std::vector<std::string> wanted, std::function<void()> wake) {
    return std::make_unique<HidBackend>(std::move(wanted), std::move(wake));
}

}  // namespace gonio
