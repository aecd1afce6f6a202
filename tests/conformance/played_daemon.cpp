#include "tests/conformance/played_daemon.h"

#include <sys/resource.h>

#include <filesystem>
#include <stdexcept>

#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/session.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/base/clock.h"

namespace gonio::conformance {

constexpr EmbeddedFile kPage[] = {{"index.html", "<!doctype html><title>x</title>"}};

PlayedDaemon::PlayedDaemon(const HttpLimits& limits) {
    HttpOptions options;
    options.port = 0;
    options.server_name = "goniod test";
    options.renderer = "none";
    options.page = kPage;
    options.limits = limits;
    HttpServer::Callbacks callbacks;
    callbacks.request = [this](SessionId session, const v1::ClientMessage& message) { return take(session, message); };
    callbacks.demand = [this](Demand demand) {
        const std::lock_guard lock(mutex_);
        demand_ = demand;
        changed_.notify_all();
    };
    callbacks.closed = [this](SessionId) {
        const std::lock_guard lock(mutex_);
        ++closed_;
        changed_.notify_all();
    };
    auto started = HttpServer::start(options, std::move(callbacks));
    if (!started) throw std::runtime_error(started.error().text());
    front_ = std::move(*started);
    v1::State state;
    state.set_scene_rev(1);
    state.set_scene("cornell");
    front_->publish_state(state);
    v1::VideoConfig config;
    config.set_codec("avc1.42C020");
    config.set_width_px(320);
    config.set_height_px(320);
    front_->publish_video_config(config);
}

// On the net thread.
bool PlayedDaemon::take(SessionId session, const v1::ClientMessage& message) {
    v1::ServerMessage answer;
    answer.set_request_id(message.request_id());
    if (message.has_profile()) {
        answer.mutable_profile()->set_light(message.profile().light());
    } else if (message.has_capture()) {
        const std::lock_guard lock(mutex_);
        ++captures_;
        changed_.notify_all();
        return true;  // it never comes
    } else {
        answer.mutable_state()->set_scene_rev(1);
    }
    front_->reply(session, std::move(answer));
    return true;
}

unsigned PlayedDaemon::clients() const {
    const std::lock_guard lock(mutex_);
    return demand_.clients;
}
unsigned PlayedDaemon::sessions_closed() const {
    const std::lock_guard lock(mutex_);
    return closed_;
}
unsigned PlayedDaemon::captures_asked() const {
    const std::lock_guard lock(mutex_);
    return captures_;
}
bool PlayedDaemon::key_wanted() const {
    const std::lock_guard lock(mutex_);
    return demand_.key();
}

void PlayedDaemon::publish(std::uint32_t scene_rev, bool key, std::size_t bytes) {
    std::vector<LaneRequest> requests;
    {
        // A viewer may have its Ready before its request is told.
        std::unique_lock lock(mutex_);
        changed_.wait_for(lock, std::chrono::seconds(1), [&] { return !demand_.lanes.empty(); });
        requests = demand_.lanes;
    }
    for (const LaneRequest& request : requests) {
        EncodedFrame frame;
        frame.data.assign(bytes, std::byte{0x65});
        frame.key = key || request.key;
        frame.lane = request.lane;
        frame.scene_rev = scene_rev;
        frame.drained_ns = frame.rendered_ns = frame.encoded_ns = monotonic_ns();
        front_->publish_h264(std::move(frame), false);
    }
}

bool PlayedDaemon::wait_until_alone(std::chrono::milliseconds time) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, time, [&] { return demand_.clients == 0 && demand_.jpeg_clients == 0; });
}
bool PlayedDaemon::wait_for_captures(unsigned count, std::chrono::milliseconds time) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, time, [&] { return captures_ >= count; });
}

std::size_t open_descriptors() {
    const std::filesystem::directory_iterator all("/proc/self/fd");
    return static_cast<std::size_t>(std::distance(begin(all), end(all)));
}

std::size_t raise_descriptor_limit() {
    rlimit files{};
    getrlimit(RLIMIT_NOFILE, &files);
    files.rlim_cur = files.rlim_max;
    setrlimit(RLIMIT_NOFILE, &files);
    return files.rlim_cur;
}

}  // namespace gonio::conformance
