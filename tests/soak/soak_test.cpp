// goniod for a long time: lights, faders and cameras move, viewers of every kind come and go beside one on a narrow
// line, photometry and scenes are uploaded, the largest too, stills are taken, the GL context is lost; then a pause,
// after which every viewer's newest frame is the newest state's and /metrics is what Prometheus reads. Memory and
// descriptors stay what they were. GONIO_SOAK_MINUTES sets the time (./dev soak); without it a short version runs.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <future>
#include <numbers>
#include <random>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/light.pb.h"
#include "server/scene/scene.h"
#include "server/session/command_files.h"
#include "tests/e2e/daemon_process.h"
#include "tests/e2e/largest_files.h"
#include "tests/load/swarm.h"
#include "tests/soak/footprint.h"
#include "tests/soak/http_answer.h"
#include "tests/soak/metrics_text.h"
#include "tests/soak/operator.h"
#include "tests/throttle/throttle_proxy.h"

namespace gonio::soak {
namespace {

using namespace std::chrono_literals;
using conformance::Clock;
using conformance::RawPeer;
using load::Kind;
using load::Tally;

constexpr double kShortMinutes = 0.25;
constexpr auto kMovement = 8s;
constexpr auto kTick = 33ms;
constexpr auto kCurrent = 10s;  // after a pause begins, for every viewer's newest frame: a busy machine's time
constexpr std::size_t kMostViewers = 8;
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

double minutes_wanted() {
    const char* text = std::getenv("GONIO_SOAK_MINUTES");
    return text == nullptr ? kShortMinutes : std::max(std::atof(text), 0.05);
}

// Pictures between two losses of the GL context.
std::string loss_every() {
    return minutes_wanted() < 2 ? "60" : "600";
}

// Result: what is wrong with the still, "" for nothing; it must hold `rev` or something newer.
std::string fetch_still(std::uint16_t port, std::uint32_t rev) {
    RawPeer peer(port);
    const auto until = Clock::now() + 60s;
    peer.send("GET /v1/frame.jpg HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
    const std::string head = peer.read_head(until);
    if (!head.starts_with("HTTP/1.1 200 ")) return "still: " + head.substr(0, head.find('\r'));
    const std::size_t shown = head.find("X-Scene-Rev: "), length = head.find("Content-Length: ");
    if (shown == std::string::npos || std::stoul(head.substr(shown + 13)) < rev) return "a still of an older revision";
    const std::size_t bytes = std::stoul(head.substr(length + 16));
    const std::string image = peer.read_bytes(bytes, until);
    return image.size() == bytes && image.starts_with("\xff\xd8\xff") ? "" : "a still that is no JPEG";
}

class Soak : public testing::Test {
protected:
    test::DaemonProcess daemon_{{"--renderer", "gl", "--size", "320x320", "--max-transport-mib", "256", "--surfaces",
                                 "off", "--inject", "gl-loss-every=" + loss_every()}};
    // Before anybody connects, because a client that answers no ping meanwhile is dropped. Stills wait for the
    // transport, and movement takes what time a slow machine has.
    const bool transport_ready_ = daemon_.transport_ready();
    const std::uint16_t port_ = test::port_of(daemon_.url());
    load::Swarm swarm_{port_};
    test::ThrottleProxy line_{port_, {1e6, 20ms, 16 << 10}};
    load::Swarm far_{line_.port()};  // one viewer at the end of a line of 1 Mb/s
    Operator operator_{port_};
    std::mt19937 random_{30};
    std::vector<int> viewers_, guests_;  // guests: slow and deaf ones
    std::future<std::string> still_;
    std::string light_ = "luminaire";
    std::uint64_t tick_ = 0, joins_ = 0, uploads_ = 0, scenes_ = 0, stills_ = 0, frames_ = 0, pauses_ = 0;
    double losses_ = 0;
    std::vector<std::uint32_t> latency_us_;

    double any(double from, double to) { return std::uniform_real_distribution<double>(from, to)(random_); }

    void move() {
        const double t = static_cast<double>(tick_) * 0.05;
        v1::Command light;
        light.mutable_set_light()->set_name(light_);
        switch (tick_ % 4) {
            case 0:
                for (const double x : {std::sin(t), 3.2 + 0.3 * std::sin(2 * t), std::cos(t)})
                    light.mutable_set_light()->add_position_m(x);
                break;
            case 1:
                light.mutable_set_light()->set_level_ratio(0.5 + 0.5 * std::sin(t));
                break;
            case 2:
                light.mutable_set_light()->set_pan_rad(std::remainder(t, 2 * std::numbers::pi));
                light.mutable_set_light()->set_tilt_rad(0.5 * std::sin(t));
                break;
            default:
                for (int channel = 0; channel < 3; ++channel) light.mutable_set_light()->add_color_rgb(any(0.2, 1));
        }
        operator_.send(light);
        if (tick_ % 30 == 10) {
            v1::Command camera;
            for (const double x : {0.5 * std::sin(t), 2.0, 7.0}) camera.mutable_set_camera()->add_eye_m(x);
            operator_.send(camera);
        }
        if (tick_ % 60 == 20) {
            v1::Command exposure;
            exposure.mutable_set_exposure()->set_ev100(any(4, 7));
            operator_.send(exposure);
        }
    }
    void upload() {
        v1::Command command;
        command.mutable_set_light()->set_name(light_);
        v1::Profile& profile = *command.mutable_set_light()->mutable_profile();
        profile.set_name("soak" + std::to_string(uploads_) + ".ies");
        profile.set_photometry(uploads_ % 8 == 5 ? test::fine_ies(kMaxProfileBytes / 11)
                                                 : test::isotropic_ies(any(100, 2000)));
        operator_.send(command);
        ++uploads_;
    }
    // Lights, presets and views come and go too.
    void rearrange() {
        v1::Command add, remove, save, recall, view;
        v1::AddLight& added = *add.mutable_add_light();
        added.mutable_light()->set_name("guest");
        added.mutable_light()->mutable_profile()->set_name("narrow_spot");
        for (const double x : {0.5, 3.0, 0.5}) added.mutable_light()->add_position_m(x);
        operator_.send(add);
        save.mutable_save_preset()->set_name("look");
        operator_.send(save);
        view.mutable_set_view()->set_view(tick_ % 2 == 0 ? "illuminance" : "beauty");
        operator_.send(view);
        operator_.settle(10s);
        remove.mutable_remove_light()->set_name("guest");
        operator_.send(remove);
        recall.mutable_recall_preset()->set_name("look");
        operator_.send(recall);
    }
    // A scene comes by HTTP, is shown, and makes room for the first one again, whose lights then move on.
    void upload_scene() {
        const bool large = !kSanitized && scenes_ % 4 == 2;  // under sanitizers it takes minutes
        const std::string name = large ? "hills.glb" : "soak.gltf",
                          scene = large ? test::hills_glb(800) : test::floor_gltf(any(0.2, 0.8));
        const auto [status, said] = put_upload(port_, name, scene);
        ASSERT_TRUE(status == 200 || status == 201) << status << " " << said;
        for (const std::string& file : {"upload:" + name, std::string("cornell")}) {
            v1::Command load;
            load.mutable_load_scene()->set_file(file);
            operator_.send(load);
            ASSERT_TRUE(operator_.settle(20s)) << file << " is not loaded";
        }
        ++scenes_;
    }
    void scrape() {
        const auto [status, text] = http_answer(port_, "GET /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n");
        ASSERT_EQ(status, 200);
        EXPECT_EQ(metrics_fault(text), "");
        for (const char* name : {"gonio_frames_rendered_total", "gonio_render_seconds_count",
                                 "gonio_readback_seconds_count", "gonio_send_seconds_count"})
            EXPECT_GT(metric_value(text, name), 0) << name;
        if (scenes_ > 0) {
            EXPECT_GT(metric_value(text, "gonio_uploaded_bytes_total"), 0);
        }
        EXPECT_GE(metric_value(text, "gonio_inflight_bytes"), 0);
        losses_ = metric_value(text, "gonio_gpu_resets_total");
    }
    void come_and_go() {
        joins_ += 1;
        if (viewers_.size() < 2 || (viewers_.size() < kMostViewers && random_() % 2 == 0)) {
            viewers_.push_back(swarm_.join(Kind::viewer));
            ASSERT_GT(viewers_.back(), 0) << "a viewer was refused";
        } else if (random_() % 3 != 0) {
            leave(viewers_, random_() % viewers_.size());
        } else if (guests_.size() < 3) {
            guests_.push_back(random_() % 2 == 0 ? swarm_.join(Kind::deaf) : swarm_.join(Kind::slow, 20e3));
            ASSERT_GT(guests_.back(), 0) << "a slow viewer was refused";
        } else {
            leave(guests_, random_() % guests_.size());
        }
    }
    void leave(std::vector<int>& who, std::size_t at) {
        const int id = who[at];
        account(swarm_.tally(id));
        swarm_.leave(id, random_() % 2 == 0);
        who.erase(who.begin() + static_cast<std::ptrdiff_t>(at));
    }
    void account(const Tally& tally) {
        EXPECT_EQ(tally.older, 0u) << "a frame older than one that had come";
        frames_ += tally.frames;
        if (tally.kind != Kind::viewer) return;
        EXPECT_FALSE(tally.gone) << "a viewer was closed with " << tally.close_code;
        latency_us_.insert(latency_us_.end(), tally.latency_us.begin(), tally.latency_us.end());
    }
    void take_still() {
        if (still_.valid()) {
            if (still_.wait_for(0s) != std::future_status::ready) return;
            EXPECT_EQ(still_.get(), "");
        }
        still_ = std::async(std::launch::async, fetch_still, port_, operator_.newest_rev());
        ++stills_;
    }
    void movement() {
        auto next = Clock::now();
        for (const auto until = next + kMovement; Clock::now() < until && !HasFatalFailure(); next += kTick) {
            std::this_thread::sleep_until(next);
            ++tick_;
            move();
            if (tick_ % 12 == 3) come_and_go();
            if (tick_ % 45 == 7) upload();
            if (tick_ % 50 == 9) take_still();
            if (tick_ % 240 == 100) rearrange();
            if (tick_ % 240 == 200) upload_scene();
            operator_.listen();
        }
        ASSERT_TRUE(operator_.settle(20s)) << "commands without an answer";
    }
    // Nothing is asked for any more: every viewer comes to see the newest state.
    void pause() {
        v1::ClientMessage get;
        get.mutable_get_state();
        const auto state = operator_.ask(get, 10s);
        ASSERT_TRUE(state && state->has_state()) << "no state came";
        const std::uint32_t newest = state->state().scene_rev();
        for (const auto until = Clock::now() + kCurrent;; std::this_thread::sleep_for(10ms)) {
            std::string behind;
            for (const Tally& viewer : swarm_.tallies(Kind::viewer))
                if (viewer.newest_rev != newest) behind += " " + std::to_string(viewer.newest_rev);
            for (const Tally& viewer : far_.tallies(Kind::viewer))
                if (viewer.newest_rev != newest) behind += " (far) " + std::to_string(viewer.newest_rev);
            if (behind.empty()) break;
            ASSERT_LT(Clock::now(), until) << "the scene is at " << newest << ", viewers see" << behind;
        }
        ++pauses_;
        for (const Tally& viewer : swarm_.tallies(Kind::viewer)) account(viewer);
        swarm_.reset_tallies();
        for (const Tally& viewer : far_.tallies(Kind::viewer)) {
            EXPECT_GT(viewer.frames, 0u) << "nothing came over the narrow line";
            EXPECT_EQ(viewer.older, 0u);
            EXPECT_FALSE(viewer.gone) << "the far viewer was closed with " << viewer.close_code;
        }
        far_.reset_tallies();
        scrape();
    }
};

TEST_F(Soak, StaysCurrentAndOfOneSize) {
    EXPECT_TRUE(transport_ready_);
    const double minutes = minutes_wanted();
    v1::ClientMessage get;
    get.mutable_get_state();
    const auto first = operator_.ask(get, 10s);
    ASSERT_TRUE(first && first->state().lights_size() > 0);
    light_ = first->state().lights(0).name();

    const int far = far_.join(Kind::viewer);
    ASSERT_GT(far, 0) << "the far viewer was refused";

    const auto began = Clock::now();
    const auto minute = [&] { return std::chrono::duration<double>(Clock::now() - began).count() / 60; };
    const std::size_t descriptors = footprint(daemon_.pid(), 0).descriptors;
    std::vector<Footprint> samples;
    while (minute() < minutes && !HasFatalFailure()) {
        movement();
        if (HasFatalFailure()) break;
        pause();
        if (HasFatalFailure()) break;
        samples.push_back(footprint(daemon_.pid(), minute()));
        ASSERT_TRUE(daemon_.alive());
        if (minutes >= 2 && samples.size() % 3 == 1)
            std::printf("soak: minute %.1f: %.1f MiB resident, %.1f of it anonymous, %zu descriptors, %zu viewers\n",
                        samples.back().minute, samples.back().resident_mib, samples.back().anonymous_mib,
                        samples.back().descriptors, viewers_.size());
        std::fflush(stdout);
    }
    ASSERT_FALSE(samples.empty());
    if (still_.valid()) {
        EXPECT_EQ(still_.get(), "");
    }
    while (!viewers_.empty()) leave(viewers_, 0);
    while (!guests_.empty()) leave(guests_, 0);
    far_.leave(far, true);
    EXPECT_GT(losses_, 0) << "the GL context was never lost";
    std::size_t left = 0;
    for (const auto until = Clock::now() + 10s; Clock::now() < until; std::this_thread::sleep_for(50ms))
        if ((left = footprint(daemon_.pid(), 0).descriptors) <= descriptors) break;
    EXPECT_LE(left, descriptors) << "descriptors left open";
    EXPECT_EQ(operator_.refusals().size(), 0u)
        << "refused, first: " << (operator_.refusals().empty() ? "" : operator_.refusals().front());

    // After ten minutes caches and undo are full.
    constexpr double kFull = 10, kMeasured = 10;
    const bool is_long = minutes >= 2 * (kFull + kMeasured);
    const Growth growth = is_long ? growth_of(samples, {kFull, kFull + kMeasured}, {minutes - kMeasured, 1e9})
                                  : growth_of(samples, {0.25 * minutes, 0.5 * minutes}, {0.75 * minutes, 1e9});
    if (minutes >= 5) {
        EXPECT_LT(growth.ratio(), 0.05) << "resident memory grows";
    }
    std::printf(
        "soak: %.1f min, %llu answers, %llu frames to viewers, %llu comings and goings, %llu uploads, %llu scenes, "
        "%llu stills, %.0f contexts lost, "
        "%llu pauses, "
        "all current; resident %.1f -> %.1f MiB (%+.1f %%), descriptors %zu -> %zu; NV12 to client p50 %.1f ms, p99 "
        "%.1f ms\n",
        minute(), static_cast<unsigned long long>(operator_.answered()), static_cast<unsigned long long>(frames_),
        static_cast<unsigned long long>(joins_), static_cast<unsigned long long>(uploads_),
        static_cast<unsigned long long>(scenes_), static_cast<unsigned long long>(stills_), losses_,
        static_cast<unsigned long long>(pauses_),
        growth.early_mib > 0 ? growth.early_mib : samples.front().resident_mib,
        growth.late_mib > 0 ? growth.late_mib : samples.back().resident_mib, 100 * growth.ratio(), descriptors, left,
        load::percentile_ms(latency_us_, 0.5), load::percentile_ms(latency_us_, 0.99));
    EXPECT_EQ(daemon_.stop(), 0);
}

}  // namespace
}  // namespace gonio::soak
