#include "server/surfaces/control_surfaces.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <list>
#include <thread>

#include <spdlog/spdlog.h>

#include "protocol/schema/surface.pb.h"
#include "server/base/descriptor.h"
#include "server/surfaces/surface_profiles.h"

namespace gonio {

std::vector<std::string> transports_of(SurfaceOptions::Midi midi, bool owned) {
    if (midi == SurfaceOptions::Midi::usb) return {"usb-midi"};
    if (midi == SurfaceOptions::Midi::alsa) return {"alsa-midi"};
    if (owned) return {"usb-midi", "alsa-midi"};
    return {"alsa-midi", "usb-midi"};
}

void Retry::failed(std::int64_t now_ns) {
    wait_ns = wait_ns == 0 ? kFirstRetry_ns : std::min(wait_ns * 2, kLastRetry_ns);
    next_ns = now_ns + wait_ns;
}

namespace {

constexpr const char* kUnplugged = "it was unplugged";

bool is_midi(const FoundSurface& surface) {
    return surface.transport == "usb-midi" || surface.transport == "alsa-midi";
}

class DeviceThread final : public ControlSurfaces {
public:
    DeviceThread(const SurfaceOptions& options, SurfaceProfiles profiles, std::function<void()> wake)
        : midi_(options.midi),
          profiles_(std::move(profiles)),
          wake_(std::move(wake)),
          event_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
        std::vector<std::string> owned = profiles_.ids();
        owned.insert(owned.end(), options.taken.begin(), options.taken.end());
        if (options.on) {
            backends_.push_back(make_hid_backend(options.taken, [this] { poke(); }));
            backends_.push_back(make_usb_midi_backend(owned));
            backends_.push_back(make_alsa_midi_backend(owned));
        }
        if (options.replay) backends_.push_back(make_replay_backend(*options.replay));
        thread_ = std::thread([this] { run(); });
    }
    ~DeviceThread() override {
        stop_ = true;
        poke();
        thread_.join();
    }
    Latest<SurfaceUpdates>& updates() override { return updates_; }
    Latest<SurfaceTable>& table() override { return table_; }
    void show(SurfaceTargets targets) override {
        targets_.put(std::move(targets));
        poke();
    }

private:
    struct Connection {
        std::unique_ptr<SurfaceConnection> surface;
        Backend* backend = nullptr;
        std::string gone;  // why; not empty: to be taken away
    };
    // A surface that is not connected, for the table.
    struct Missing {
        std::string product, state, error;
    };

    void poke() {
        const std::uint64_t one = 1;
        [[maybe_unused]] const auto written = ::write(event_.fd(), &one, sizeof one);
    }

    void run() {
        while (!stop_) {
            std::vector<pollfd> fds = {{event_.fd(), POLLIN, 0}};
            for (const auto& backend : backends_) backend->watch(fds);
            const std::int64_t sleep_ns = std::clamp<std::int64_t>(next_ns() - monotonic_ns(), 0, kRescan_ns);
            const timespec time{sleep_ns / 1'000'000'000, sleep_ns % 1'000'000'000};
            ::ppoll(fds.data(), fds.size(), &time, nullptr);
            std::uint64_t count = 0;
            while (::read(event_.fd(), &count, sizeof count) > 0) {
            }
            serve();
        }
    }

    std::int64_t next_ns() const {
        const std::int64_t now_ns = monotonic_ns();
        std::int64_t next = std::min(scanned_ns_ + kRescan_ns, table_stale_ ? tabled_ns_ + kTableEvery_ns : INT64_MAX);
        const auto earlier = [&](std::int64_t at_ns) { next = at_ns == 0 ? next : std::min(next, at_ns); };
        for (const auto& backend : backends_) earlier(backend->due_ns());
        for (const Connection& connection : connections_) earlier(connection.surface->due_ns(now_ns));
        for (const auto& [path, retry] : retries_) earlier(retry.next_ns);
        return next;
    }

    void serve() {
        pending_ = {};
        for (const auto& backend : backends_) backend->serve();
        drop_gone();
        std::int64_t now_ns = monotonic_ns();
        bool rescan = now_ns - scanned_ns_ >= kRescan_ns;
        for (const auto& backend : backends_) rescan = backend->changed() || rescan;
        for (const auto& [path, retry] : retries_) rescan = rescan || retry.next_ns <= now_ns;
        if (rescan) scan(now_ns);
        if (auto targets = targets_.try_take()) {
            wanted_ = std::move(*targets);
            for (Connection& connection : connections_)
                connection.surface->want(wanted_[connection.surface->surface().identity]);
        }
        now_ns = monotonic_ns();
        for (Connection& connection : connections_) connection.surface->tick(now_ns, pending_);
        const bool news = !pending_.controls.empty() || !pending_.attached.empty();
        if (news || pending_.timecode || !pending_.cues.empty()) send_updates();
        table_stale_ = table_stale_ || news;
        if (table_stale_ && (now_ns - tabled_ns_ >= kTableEvery_ns || roster_changed_)) send_table(now_ns);
    }

    // Added to what the render thread has not taken yet.
    void send_updates() {
        updates_.merge([&](SurfaceUpdates& updates) { updates.add(std::move(pending_)); });
        wake_();
    }

    void drop_gone() {
        std::erase_if(connections_, [&](const Connection& connection) {
            if (connection.gone.empty()) return false;
            const FoundSurface& surface = connection.surface->surface();
            spdlog::info("fader box {} ({}): {}", surface.identity, surface.product, connection.gone);
            missing_[{surface.identity, surface.transport}] = {surface.product, "gone", connection.gone};
            roster_changed_ = table_stale_ = true;
            return true;
        });
    }

    // Of MIDI also by another way to the same surface.
    bool connected(const FoundSurface& surface) const {
        return std::ranges::any_of(connections_, [&](const Connection& connection) {
            const FoundSurface& other = connection.surface->surface();
            return is_midi(surface) ? is_midi(other) && other.identity == surface.identity : other.path == surface.path;
        });
    }

    void scan(std::int64_t now_ns) {
        scanned_ns_ = now_ns;
        std::vector<std::pair<FoundSurface, Backend*>> found;
        for (const auto& backend : backends_)
            for (FoundSurface& surface : backend->scan()) found.emplace_back(std::move(surface), backend.get());
        std::erase_if(retries_, [&](const auto& retry) {
            return std::ranges::none_of(found, [&](const auto& one) { return one.first.path == retry.first; });
        });
        // A wire mostly says itself that its surface has gone; the list says it too, and either may be first.
        for (Connection& connection : connections_)
            if (std::ranges::none_of(
                    found, [&](const auto& one) { return one.first.path == connection.surface->surface().path; }))
                connection.gone = kUnplugged;
        drop_gone();
        for (auto& [key, missing] : missing_) {
            const bool there = std::ranges::any_of(found, [&key = key](const auto& one) {
                return std::pair(one.first.identity, one.first.transport) == key;
            });
            if (there || missing.state == "gone") continue;
            missing.state = "gone";
            missing.error = kUnplugged;
            roster_changed_ = table_stale_ = true;
        }
        // The way that is tried first comes first.
        const auto rank = [&](const auto& one) {
            const FoundSurface& surface = one.first;
            if (!is_midi(surface)) return std::ptrdiff_t{0};
            const auto order = transports_of(midi_, surface.owned);
            return std::ranges::find(order, surface.transport) - order.begin();
        };
        std::ranges::stable_sort(found, {}, rank);
        for (auto& [surface, backend] : found) {
            const auto order = transports_of(midi_, surface.owned);
            const bool wanted = !is_midi(surface) || std::ranges::find(order, surface.transport) != order.end();
            const auto retry = retries_.find(surface.path);
            const bool waits = retry != retries_.end() && retry->second.next_ns > now_ns;
            if (wanted && !waits && !connected(surface)) attach(surface, *backend, now_ns);
        }
    }

    void attach(const FoundSurface& surface, Backend& backend, std::int64_t now_ns) {
        const std::string id = surface_identity(surface.vendor_id, surface.product_id, "", "");
        const auto fail = [&](const Error& error) {
            Retry& retry = retries_[surface.path];
            retry.failed(now_ns);
            Missing& row = missing_[{surface.identity, surface.transport}];
            const bool vanished = error.code == "vanished";  // the list is not of this moment
            if (row.error != error.message && !vanished) {
                spdlog::warn("fader box {} ({}): {}", surface.identity, surface.product, error.text());
                roster_changed_ = table_stale_ = true;
            }
            row = {surface.product, vanished ? "gone" : "waiting", vanished ? kUnplugged : error.message};
        };
        if (connections_.size() >= kMaxSurfaces)
            return fail({"too_large", surface.path, "", "there are too many boxes: at most 32 are used"});
        auto made = SurfaceConnection::make(
            surface, surface.transport == "hid" ? SurfaceProfile{} : profiles_.find(id, surface.product));
        if (!made) return fail(made.error());
        Connection& connection = connections_.emplace_back();
        connection.surface = std::move(*made);
        connection.backend = &backend;
        // Links stay where they are (a list), and wires go before them.
        auto wire = backend.open(surface, {[this, &connection](auto messages, std::size_t bad, std::int64_t t_ns) {
                                               connection.surface->take_midi(messages, bad, t_ns, pending_);
                                               table_stale_ = true;
                                           },
                                           [this, &connection](Bytes report, std::int64_t t_ns) {
                                               connection.surface->take_report(report, t_ns, pending_);
                                               table_stale_ = true;
                                           },
                                           [&connection](std::string why) { connection.gone = std::move(why); },
                                           [this, &connection](MidiNews news, std::int64_t t_ns) {
                                               connection.surface->take_system(std::move(news), t_ns, pending_);
                                               table_stale_ = true;
                                           }});
        if (!wire) {
            connections_.pop_back();
            return fail(wire.error());
        }
        connection.surface->connect(std::move(*wire));
        connection.surface->want(wanted_[surface.identity]);
        retries_.erase(surface.path);
        std::erase_if(missing_, [&](const auto& row) { return row.first.first == surface.identity; });
        pending_.attached.push_back(surface.identity);
        roster_changed_ = table_stale_ = true;
        spdlog::info("fader box {} ({}): attached by {}", surface.identity, surface.product, surface.transport);
    }

    void send_table(std::int64_t now_ns) {
        SurfaceTable table;
        if (roster_changed_) ++roster_;
        roster_changed_ = table_stale_ = false;
        tabled_ns_ = now_ns;
        table.roster = roster_;
        for (const Connection& connection : connections_) {
            const FoundSurface& surface = connection.surface->surface();
            v1::SurfaceDevice& row = *table.table.add_devices();
            row.set_device(surface.identity);
            row.set_product(surface.product);
            row.set_transport(surface.transport);
            row.set_state("live");
            connection.surface->describe(row);
            for (const v1::SurfaceRow& drives : connection.surface->rows()) {
                v1::SurfaceRow& added = *table.table.add_default_rows();
                added = drives;
                added.set_device(surface.identity);
            }
        }
        for (const auto& [key, missing] : missing_) {
            v1::SurfaceDevice& row = *table.table.add_devices();
            row.set_device(key.first);
            row.set_product(missing.product);
            row.set_transport(key.second);
            row.set_state(missing.state);
            row.set_error(missing.error);
        }
        while (missing_.size() > kMaxSurfaces) missing_.erase(missing_.begin());
        table_.put(std::move(table));
        wake_();
    }

    SurfaceOptions::Midi midi_;
    SurfaceProfiles profiles_;
    std::function<void()> wake_;
    Descriptor event_;  // the threads of wires write it until their end
    std::vector<std::unique_ptr<Backend>> backends_;
    std::list<Connection> connections_;                               // wires end before what they belong to
    std::map<std::string, Retry> retries_;                            // by path
    std::map<std::pair<std::string, std::string>, Missing> missing_;  // by identity and transport
    SurfaceUpdates pending_;                                          // what came in this turn
    SurfaceTargets wanted_;
    Latest<SurfaceUpdates> updates_;
    Latest<SurfaceTable> table_;
    Latest<SurfaceTargets> targets_;
    std::int64_t scanned_ns_ = 0, tabled_ns_ = 0;
    std::uint32_t roster_ = 0;
    bool roster_changed_ = false, table_stale_ = true;
    std::atomic<bool> stop_{false};
    std::thread thread_;
};

}  // namespace

Result<std::unique_ptr<ControlSurfaces>> ControlSurfaces::start(const SurfaceOptions& options,
                                                                std::function<void()> wake) {
    auto profiles = SurfaceProfiles::load(options.profiles);
    if (!profiles) return profiles.error();
    return std::unique_ptr<ControlSurfaces>(
        std::make_unique<DeviceThread>(options, std::move(*profiles), std::move(wake)));
}

}  // namespace gonio
