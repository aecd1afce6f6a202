#include "server/surfaces/surfaces.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <list>
#include <thread>

#include <spdlog/spdlog.h>

#include "server/surfaces/alsa_midi.h"
#include "server/surfaces/box_profiles.h"
#include "server/surfaces/hid_devices.h"
#include "server/surfaces/usb_midi.h"

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

class DeviceThread final : public Surfaces {
public:
    DeviceThread(const SurfaceOptions& options, BoxProfiles profiles, std::function<void()> wake)
        : midi_(options.midi),
          profiles_(std::move(profiles)),
          wake_(std::move(wake)),
          event_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
        std::vector<std::string> owned = profiles_.ids();
        owned.insert(owned.end(), options.boxes.begin(), options.boxes.end());
        if (options.on) {
            backends_.push_back(make_hid_backend(options.boxes, [this] { poke(); }));
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
        links_.clear();  // wires before what they belong to
        backends_.clear();
        ::close(event_);
    }
    Latest<SurfaceMail>& mail() override { return mail_; }
    Latest<SurfaceTable>& table() override { return table_; }
    void show(SurfaceWants wants) override {
        wants_.put(std::move(wants));
        poke();
    }

private:
    struct Link {
        std::unique_ptr<BoxLink> box;
        Backend* backend = nullptr;
        std::string gone;  // why; not empty: to be taken away
    };
    // A box that is not connected, for the table.
    struct Missing {
        std::string product, transport, state, error;
    };

    void poke() {
        const std::uint64_t one = 1;
        [[maybe_unused]] const auto written = ::write(event_, &one, sizeof one);
    }

    void run() {
        while (!stop_) {
            std::vector<pollfd> fds = {{event_, POLLIN, 0}};
            for (const auto& backend : backends_) backend->watch(fds);
            const std::int64_t sleep_ns = std::clamp<std::int64_t>(next_ns() - device_clock_ns(), 0, kRescan_ns);
            const timespec time{sleep_ns / 1'000'000'000, sleep_ns % 1'000'000'000};
            ::ppoll(fds.data(), fds.size(), &time, nullptr);
            std::uint64_t count = 0;
            while (::read(event_, &count, sizeof count) > 0) {
            }
            serve();
        }
    }

    std::int64_t next_ns() const {
        const std::int64_t now_ns = device_clock_ns();
        std::int64_t next = std::min(scanned_ns_ + kRescan_ns, table_stale_ ? tabled_ns_ + kTableEvery_ns : INT64_MAX);
        const auto earlier = [&](std::int64_t at_ns) { next = at_ns == 0 ? next : std::min(next, at_ns); };
        for (const auto& backend : backends_) earlier(backend->due_ns());
        for (const Link& link : links_) earlier(link.box->due_ns(now_ns));
        for (const auto& [place, retry] : retries_) earlier(retry.next_ns);
        return next;
    }

    void serve() {
        pending_ = {};
        for (const auto& backend : backends_) backend->serve();
        drop_gone();
        std::int64_t now_ns = device_clock_ns();
        bool rescan = now_ns - scanned_ns_ >= kRescan_ns;
        for (const auto& backend : backends_) rescan = backend->changed() || rescan;
        for (const auto& [place, retry] : retries_) rescan = rescan || retry.next_ns <= now_ns;
        if (rescan) scan(now_ns);
        if (auto wants = wants_.try_take()) {
            wanted_ = std::move(*wants);
            for (Link& link : links_) link.box->want(wanted_[link.box->box().identity]);
        }
        now_ns = device_clock_ns();
        for (Link& link : links_) link.box->tick(now_ns, pending_);
        const bool news = !pending_.controls.empty() || !pending_.attached.empty();
        if (news) send_mail();
        table_stale_ = table_stale_ || news;
        if (table_stale_ && (now_ns - tabled_ns_ >= kTableEvery_ns || roster_changed_)) send_table(now_ns);
    }

    // The newest of each control, added to what the render thread has not taken yet.
    void send_mail() {
        mail_.merge([&](SurfaceMail& mail) {
            for (const std::string& device : pending_.attached) {
                std::erase_if(mail.controls, [&](const auto& one) {
                    return one.first.first == device && !pending_.controls.contains(one.first);
                });
                mail.attached.push_back(device);
            }
            for (auto& [key, heard] : pending_.controls) {
                auto [at, fresh] = mail.controls.try_emplace(key, heard);
                if (fresh) continue;
                at->second.input.value = heard.input.value;
                at->second.input.clicks += heard.input.clicks;
                at->second.input.presses += heard.input.presses;
            }
        });
        wake_();
    }

    void drop_gone() {
        for (auto link = links_.begin(); link != links_.end();) {
            if (link->gone.empty()) {
                ++link;
                continue;
            }
            const FoundBox& box = link->box->box();
            spdlog::info("fader box {} ({}): {}", box.identity, box.product, link->gone);
            missing_[box.identity + " " + box.transport] = {box.product, box.transport, "gone", link->gone};
            link = links_.erase(link);
            roster_changed_ = table_stale_ = true;
        }
    }

    bool connected(const std::string& identity, bool midi) const {
        return std::any_of(links_.begin(), links_.end(), [&](const Link& link) {
            const FoundBox& box = link.box->box();
            return box.identity == identity && (box.transport == "usb-midi" || box.transport == "alsa-midi") == midi;
        });
    }

    void scan(std::int64_t now_ns) {
        scanned_ns_ = now_ns;
        std::vector<std::pair<FoundBox, Backend*>> found;
        for (const auto& backend : backends_)
            for (FoundBox& box : backend->scan()) found.push_back({std::move(box), backend.get()});
        std::erase_if(retries_, [&](const auto& retry) {
            return std::none_of(found.begin(), found.end(),
                                [&](const auto& one) { return one.first.place == retry.first; });
        });
        // A wire mostly says itself that its box has gone; the list says it too, and either may be first.
        for (Link& link : links_)
            if (std::none_of(found.begin(), found.end(),
                             [&](const auto& one) { return one.first.place == link.box->box().place; }))
                link.gone = kUnplugged;
        drop_gone();
        for (auto& [key, missing] : missing_) {
            const bool there = std::any_of(found.begin(), found.end(), [&key = key](const auto& one) {
                return one.first.identity + " " + one.first.transport == key;
            });
            if (there || missing.state == "gone") continue;
            missing.state = "gone";
            missing.error = kUnplugged;
            roster_changed_ = table_stale_ = true;
        }
        // The way that is tried first comes first.
        const auto rank = [&](const FoundBox& box) {
            if (box.transport != "usb-midi" && box.transport != "alsa-midi") return std::ptrdiff_t{0};
            const auto order = transports_of(midi_, box.owned);
            return std::find(order.begin(), order.end(), box.transport) - order.begin();
        };
        std::stable_sort(found.begin(), found.end(),
                         [&](const auto& a, const auto& b) { return rank(a.first) < rank(b.first); });
        for (auto& [box, backend] : found) {
            const bool midi = box.transport == "usb-midi" || box.transport == "alsa-midi";
            if (midi) {
                const auto order = transports_of(midi_, box.owned);
                if (std::find(order.begin(), order.end(), box.transport) == order.end() ||
                    connected(box.identity, true))
                    continue;
            } else if (std::any_of(links_.begin(), links_.end(),
                                   [&box = box](const Link& link) { return link.box->box().place == box.place; })) {
                continue;
            }
            if (const auto retry = retries_.find(box.place); retry != retries_.end() && retry->second.next_ns > now_ns)
                continue;
            attach(box, *backend, now_ns);
        }
    }

    void attach(const FoundBox& box, Backend& backend, std::int64_t now_ns) {
        const std::string id = box_identity(box.vendor_id, box.product_id, "", "");
        const std::string missing = box.identity + " " + box.transport;
        const auto fail = [&](const Error& error) {
            Retry& retry = retries_[box.place];
            retry.failed(now_ns);
            Missing& row = missing_[missing];
            if (row.error != error.message && error.code != "vanished") {
                spdlog::warn("fader box {} ({}): {}", box.identity, box.product, error.text());
                roster_changed_ = table_stale_ = true;
            }
            if (error.code == "vanished")
                row = {box.product, box.transport, "gone", kUnplugged};  // the list is not of this moment
            else
                row = {box.product, box.transport, "waiting", error.message};
        };
        if (links_.size() >= kMaxBoxes)
            return fail({"too_large", box.place, "", "there are too many boxes: at most 32 are used"});
        auto made = BoxLink::make(box, box.transport == "hid" ? BoxProfile{} : profiles_.find(id, box.product));
        if (!made) return fail(made.error());
        Link& link = links_.emplace_back();
        link.box = std::move(*made);
        link.backend = &backend;
        // Links stay where they are (a list), and wires go before them.
        auto wire = backend.open(box, {[this, &link](auto messages, std::size_t bad, std::int64_t t_ns) {
                                           link.box->take_midi(messages, bad, t_ns, pending_);
                                           table_stale_ = true;
                                       },
                                       [this, &link](Bytes report, std::int64_t t_ns) {
                                           link.box->take_report(report, t_ns, pending_);
                                           table_stale_ = true;
                                       },
                                       [&link](std::string why) { link.gone = std::move(why); }});
        if (!wire) {
            links_.pop_back();
            return fail(wire.error());
        }
        link.box->connect(std::move(*wire));
        link.box->want(wanted_[box.identity]);
        retries_.erase(box.place);
        std::erase_if(missing_, [&](const auto& row) { return row.first.starts_with(box.identity + " "); });
        pending_.attached.push_back(box.identity);
        roster_changed_ = table_stale_ = true;
        spdlog::info("fader box {} ({}): attached by {}", box.identity, box.product, box.transport);
    }

    void send_table(std::int64_t now_ns) {
        SurfaceTable table;
        if (roster_changed_) ++roster_;
        roster_changed_ = table_stale_ = false;
        tabled_ns_ = now_ns;
        table.roster = roster_;
        for (const Link& link : links_) {
            const FoundBox& box = link.box->box();
            v1::SurfaceDevice& row = *table.table.add_devices();
            row.set_device(box.identity);
            row.set_product(box.product);
            row.set_transport(box.transport);
            row.set_state("live");
            link.box->describe(row);
            for (const v1::SurfaceRow& drives : link.box->rows()) {
                v1::SurfaceRow& added = *table.table.add_default_rows();
                added = drives;
                added.set_device(box.identity);
            }
        }
        for (const auto& [key, missing] : missing_) {
            v1::SurfaceDevice& row = *table.table.add_devices();
            row.set_device(key.substr(0, key.rfind(' ')));
            row.set_product(missing.product);
            row.set_transport(missing.transport);
            row.set_state(missing.state);
            row.set_error(missing.error);
        }
        while (missing_.size() > kMaxBoxes) missing_.erase(missing_.begin());
        table_.put(std::move(table));
        wake_();
    }

    SurfaceOptions::Midi midi_;
    BoxProfiles profiles_;
    std::function<void()> wake_;
    int event_;
    std::vector<std::unique_ptr<Backend>> backends_;
    std::list<Link> links_;
    std::map<std::string, Retry> retries_;    // by place
    std::map<std::string, Missing> missing_;  // by "identity transport"
    SurfaceMail pending_;                     // what came in this turn
    SurfaceWants wanted_;
    Latest<SurfaceMail> mail_;
    Latest<SurfaceTable> table_;
    Latest<SurfaceWants> wants_;
    std::int64_t scanned_ns_ = 0, tabled_ns_ = 0;
    std::uint32_t roster_ = 0;
    bool roster_changed_ = false, table_stale_ = true;
    std::atomic<bool> stop_{false};
    std::thread thread_;
};

}  // namespace

Result<std::unique_ptr<Surfaces>> Surfaces::start(const SurfaceOptions& options, std::function<void()> wake) {
    auto profiles = BoxProfiles::load(options.profiles);
    if (!profiles) return profiles.error();
    return std::unique_ptr<Surfaces>(std::make_unique<DeviceThread>(options, std::move(*profiles), std::move(wake)));
}

}  // namespace gonio
