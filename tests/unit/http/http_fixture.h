// The front over real sockets on a free port; the daemon behind it is played by the test.
#pragma once

#include "server/http/http_server.h"

#include <condition_variable>
#include <mutex>

#include "tests/unit/http_client.h"

namespace gonio::test {

using namespace std::chrono_literals;  // NOLINT

inline constexpr EmbeddedFile kPage[] = {
    {"index.html", "<!doctype html><title>x</title>"}, {"main.js", "export {};"}, {"lib/style.css", "body{}"}};

struct FrontTest : testing::Test {
    HttpOptions options;
    std::unique_ptr<HttpServer> front;
    std::mutex mutex;
    std::condition_variable changed;
    std::vector<std::pair<SessionId, v1::ClientMessage>> requests;
    std::vector<SessionId> gone;
    std::vector<Demand> demands;
    bool accept_requests = true;

    FrontTest() {
        options.port = 0;
        options.server_name = "goniod test";
        options.renderer = "none";
        options.page = kPage;
    }
    ~FrontTest() override { front.reset(); }

    void start(bool with_state = true) {
        HttpServer::Callbacks callbacks;
        callbacks.request = [this](SessionId session, v1::ClientMessage message) {
            std::lock_guard lock(mutex);
            if (!accept_requests) return false;
            requests.emplace_back(session, std::move(message));
            changed.notify_all();
            return true;
        };
        callbacks.closed = [this](SessionId session) {
            std::lock_guard lock(mutex);
            gone.push_back(session);
            changed.notify_all();
        };
        callbacks.demand = [this](Demand demand) {
            std::lock_guard lock(mutex);
            demands.push_back(demand);
            changed.notify_all();
        };
        auto started = HttpServer::start(options, std::move(callbacks));
        ASSERT_TRUE(started) << started.error().text();
        front = std::move(*started);
        if (!with_state) return;
        front->publish_state(state(1));
        v1::VideoConfig config;
        config.set_codec("avc1.42C020");
        config.set_width_px(800);
        config.set_height_px(800);
        front->publish_video_config(config);
    }
    static v1::State state(std::uint32_t rev) {
        v1::State result;
        result.set_scene_rev(rev);
        result.set_scene("cornell");
        result.add_lights()->set_name("key");
        return result;
    }
    static EncodedFrame frame(std::uint32_t rev, bool key, std::size_t bytes = 1000) {
        EncodedFrame result;
        result.data.assign(bytes, std::byte{0x65});
        result.key = key;
        result.scene_rev = rev;
        result.drained_ns = 1'000'000;
        result.rendered_ns = 3'000'000;
        result.encoded_ns = 4'500'000;
        return result;
    }
    template <typename Condition>
    bool wait_for(const Condition& condition, std::chrono::milliseconds time = 3s) {
        std::unique_lock lock(mutex);
        return changed.wait_for(lock, time, condition);
    }
    // Waits until the newest demand is as wanted.
    template <typename Condition>
    bool wait_demand(const Condition& condition, std::chrono::milliseconds time = 3s) {
        return wait_for([&] { return !demands.empty() && condition(demands.back()); }, time);
    }
};

}  // namespace gonio::test
