#include "server/daemon.h"

#include <poll.h>
#include <sys/signalfd.h>
#include <unistd.h>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <mutex>
#include <stdexcept>
#include <thread>

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include "client/web/page.h"
#include "protocol/patch_toml.h"
#include "protocol/surface_toml.h"
#include "server/assets/assets.h"
#include "server/consoles.h"
#include "server/net/front.h"
#include "server/null_renderer.h"
#include "server/oneshot.h"
#include "server/render/renderer.h"
#include "server/scene/state.h"
#include "server/stage.h"
#include "server/stream/lane_feed.h"
#include "server/stream_out.h"
#include "server/surface_hands.h"

namespace gonio {
namespace {

std::string read_token(const std::string& path) {
    if (path.empty()) return {};
    std::ifstream file(path);
    std::string token;
    if (!std::getline(file, token) || token.size() < 16) {
        throw std::runtime_error("the token file '" + path +
                                 "' must hold a token of at least 16 bytes in its first line");
    }
    return token;
}

bool is_loopback(const std::string& host) {
    return host == "localhost" || host == "::1" || host.rfind("127.", 0) == 0;
}

// Turns SIGINT and SIGTERM into a closed queue. Signals are blocked in all threads before any is started.
class Signals {
public:
    explicit Signals(std::function<void()> stop) {
        sigset_t set;
        sigemptyset(&set);
        sigaddset(&set, SIGINT);
        sigaddset(&set, SIGTERM);
        fd_ = signalfd(-1, &set, SFD_CLOEXEC);
        thread_ = std::thread([this, stop = std::move(stop)] {
            while (!done_.load()) {
                pollfd ready{fd_, POLLIN, 0};
                if (poll(&ready, 1, 100) > 0) return stop();
            }
        });
    }
    ~Signals() {
        done_ = true;
        thread_.join();
        close(fd_);
    }
    static void block() {
        sigset_t set;
        sigemptyset(&set);
        sigaddset(&set, SIGINT);
        sigaddset(&set, SIGTERM);
        pthread_sigmask(SIG_BLOCK, &set, nullptr);
        std::signal(SIGPIPE, SIG_IGN);
    }

private:
    int fd_ = -1;
    std::atomic<bool> done_{false};
    std::thread thread_;
};

Renderer::Gather gather_of(const Options& options) {
    return options.gather == "gl"     ? Renderer::Gather::gl
           : options.gather == "simd" ? Renderer::Gather::simd
                                      : Renderer::Gather::automatic;
}

std::string read_text(const std::string& path, std::size_t most_bytes, const char* what) {
    std::ifstream file(path, std::ios::binary);
    std::string text(most_bytes + 1, '\0');
    file.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(file.gcount()));
    if (!file.is_open() || file.bad())
        throw std::invalid_argument("cannot read the " + std::string(what) + " '" + path + "'");
    return text;
}

void apply_file(Scene& scene, const v1::Command& command, const std::string& path) {
    const auto applied = apply(scene, command, {});
    if (!applied) throw std::invalid_argument(path + ": " + applied.error().text());
    for (const std::string& warning : applied->warnings) spdlog::warn("{}: {}", path, warning);
}

void patch_scene(Scene& scene, const std::string& path) {
    auto patch = read_patch_toml(read_text(path, kMaxPatchFileBytes, "patch"));
    if (!patch) throw std::invalid_argument(path + ": " + patch.error().text());
    v1::Command command;
    *command.mutable_set_patch() = std::move(*patch);
    apply_file(scene, command, path);
}

void map_surfaces(Scene& scene, const std::string& path) {
    auto map = read_surfaces_toml(read_text(path, kMaxSurfaceFileBytes, "map"));
    if (!map) throw std::invalid_argument(path + ": " + map.error().text());
    v1::Command command;
    *command.mutable_set_surfaces() = std::move(*map);
    apply_file(scene, command, path);
}

SurfaceOptions surface_options(const Options& options) {
    SurfaceOptions surfaces;
    surfaces.on = options.surfaces;
    surfaces.midi = options.midi == "usb"    ? SurfaceOptions::Midi::usb
                    : options.midi == "alsa" ? SurfaceOptions::Midi::alsa
                                             : SurfaceOptions::Midi::automatic;
    for (const std::string& box : options.boxes) {  // VVVV:PPPP or VVVV:PPPP=PROFILE
        const std::string id = box.substr(0, box.find('='));
        surfaces.boxes.push_back(id);
        if (id.size() < box.size()) surfaces.profiles[id] = box.substr(id.size() + 1);
    }
    if (options.surface_replay.empty()) return surfaces;
    auto replay = read_replay(read_text(options.surface_replay, std::size_t{64} << 20, "replay"));
    if (!replay) throw std::invalid_argument(options.surface_replay + ": " + replay.error().text());
    surfaces.replay = std::move(*replay);
    return surfaces;
}

Scene first_scene(const Options& options) {
    auto asset = load_scene(options.scene);
    if (!asset) throw std::invalid_argument("cannot load the scene '" + options.scene + "': " + asset.error().text());
    for (const std::string& warning : (*asset)->warnings) spdlog::warn("{}: {}", options.scene, warning);
    Scene scene = scene_of(*asset);
    v1::Command size, technique;
    size.mutable_set_size()->set_width_px(static_cast<std::uint32_t>(std::max(options.width_px, 0)));
    size.mutable_set_size()->set_height_px(static_cast<std::uint32_t>(std::max(options.height_px, 0)));
    technique.mutable_set_technique()->set_technique(options.technique);
    if (options.samples) technique.mutable_set_technique()->set_samples(*options.samples);
    for (const v1::Command& command : {size, technique}) {
        const auto applied = apply(scene, command, {});
        if (!applied) throw std::invalid_argument(applied.error().text());
    }
    if (!options.patch_file.empty()) patch_scene(scene, options.patch_file);
    if (!options.surface_map.empty()) map_surfaces(scene, options.surface_map);
    return scene;
}

}  // namespace

int run_daemon(const Options& options) {
    Signals::block();
    spdlog::set_default_logger(spdlog::stderr_logger_mt("goniod"));
    const std::string token = read_token(options.token_file);
    if (!is_loopback(options.host) && token.empty()) {
        throw std::runtime_error("listening on " + options.host +
                                 " needs --token-file: only loopback addresses may go without");
    }
    std::optional<Scene> scene;
    SurfaceOptions boxes;
    try {
        scene = first_scene(options);
        boxes = surface_options(options);
    } catch (const std::invalid_argument& error) {
        std::fprintf(stderr, "goniod: %s\n", error.what());
        return 2;
    }
    const bool draws = options.renderer != "null";
    const auto context = draws ? gl::Context::create({options.device, options.gl_debug}) : nullptr;
    spdlog::info("{}", context ? context->description() : "no GL: grey pictures (--renderer null)");
    const std::string renderer_name = context ? context->renderer() : "null";
    if (!options.oneshot.empty()) {
        if (!context) throw std::runtime_error("--oneshot needs --renderer gl");
        Renderer renderer(*context, gather_of(options));
        return run_oneshot(renderer, std::move(*scene), options.oneshot, options.out);
    }

    Queue<Work> queue(kMaxWork);
    Latest<Demand> demands;
    std::unique_ptr<Front> front;
    LaneEncoders encoders(encoder_setup(options, scene->width_px, scene->height_px),
                          encoder_outputs(front, [&queue] { queue.wake(); }));
    LaneFeed feed(encoders);
    FrontOptions listen;
    listen.host = options.host;
    listen.port = options.port;
    listen.token = token;
    listen.server_name = "goniod " GONIO_VERSION;
    listen.renderer = renderer_name;
    listen.encoder = encoders.encoder();
    listen.private_lanes = options.max_private_lanes;
    listen.page = page_files();
    auto started =
        Front::start(listen, {
                                 [&](SessionId session, v1::ClientMessage message) {
                                     Work work;
                                     work.session = session;
                                     work.message = std::move(message);
                                     return queue.push(std::move(work));
                                 },
                                 [&](Demand demand) {
                                     demands.put(demand);
                                     queue.wake();
                                 },
                                 [&](SessionId session) {
                                     Work gone;
                                     gone.session = session;
                                     gone.closed = true;
                                     queue.push(std::move(gone));  // a full queue: its work is merely done in vain
                                 },
                             });
    if (!started) throw std::runtime_error(started.error().text());
    front = std::move(*started);

    std::unique_ptr<Inputs> inputs;
    if (options.inputs.any()) {
        auto opened = Inputs::start(options.inputs, [&] { queue.wake(); });
        if (!opened) throw std::runtime_error(opened.error().text());
        inputs = std::move(*opened);
    }
    const auto frame_time = std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 / options.target_fps));
    Consoles consoles(inputs.get(), frame_time.count());
    std::unique_ptr<Surfaces> surfaces;
    if (boxes.on || boxes.replay) {
        auto opened = Surfaces::start(boxes, [&] { queue.wake(); });
        if (!opened) throw std::runtime_error(opened.error().text());
        surfaces = std::move(*opened);
    }
    SurfaceHands hands(surfaces.get(), frame_time.count(), [&](std::uint32_t session, v1::ServerMessage message) {
        front->reply(session, std::move(message));
    });
    Stage* running = nullptr;  // for what is asked about the scene

    Demand demand;
    Loader loader;
    std::unique_ptr<LiveRenderer> renderer;
    if (context)
        renderer = std::make_unique<Renderer>(*context, gather_of(options));
    else
        renderer = std::make_unique<NullRenderer>();
    Stage stage(
        std::move(renderer), std::move(*scene), renderer_name, queue, loader,
        {
            [&](std::uint32_t session, v1::ServerMessage message) { front->reply(session, std::move(message)); },
            [&](v1::State state, v1::StateChanged change) {
                consoles.publish_state(state);
                front->publish_state(std::move(state));
                front->broadcast(std::move(change));
            },
            [&](Picture picture) {
                hands.picture_out(picture.scene_rev, picture.rendered_ns);
                feed.show(std::move(picture), monotonic_ns());
            },
            [&] {
                v1::Stats stats;
                add_lane_figures(stats, encoders, feed, demand.jpeg_clients, monotonic_ns());
                stats.set_packets_sent(front->packets_sent());
                stats.set_clients(demand.clients);
                return stats;
            },
            [&] { return consoles.sources(); },
            [&] { return hands.describe(running->scene()); },
            [&](std::uint32_t session, std::uint32_t request_id, double timeout_s) {
                hands.learn(session, request_id, timeout_s);
            },
            [&](std::uint32_t session) { hands.forget_session(session); },
        });
    if (options.keep_up) stage.set_budget(1e3 / options.target_fps);
    running = &stage;
    front->publish_state(full_state(stage.scene()));
    consoles.publish_state(full_state(stage.scene()));
    Signals signals([&] { queue.close(); });

    // READY means: a first frame has been rendered and encoded, so that whoever connects sees a picture at once.
    stage.begin_frame(monotonic_ns());
    stage.finish_frames(true);
    const LaneId first_lane = options.max_private_lanes > 0 ? kFirstPrivateLane : kSharedLane;
    encoders.encode_first(first_lane, feed.newest());
    feed.tried(first_lane);
    std::printf("READY http://%s:%u\n",
                options.host.find(':') == std::string::npos ? options.host.c_str() : ("[" + options.host + "]").c_str(),
                front->port());
    std::fflush(stdout);

    std::int64_t last_begin_ns = 0, last_moved_ns = 0;
    while (!queue.closed()) {
        // Somebody must be able to take a picture: a viewer with credit, or a report that is waited for.
        const bool viewer = feed.wanted();
        const std::int64_t now = monotonic_ns();
        const bool moves = hands.waiting(now) || stage.fading();
        const bool due = ((stage.frame_wanted() || moves) && viewer) || stage.report_wanted();
        const std::int64_t wait_ns = due ? std::max<std::int64_t>(0, last_begin_ns + frame_time.count() - now) : 0;
        std::optional<Work> work;
        stage.set_watched(feed.watched());
        const bool refining =
            stage.refinable() && stage.rests() && viewer && !due && !stage.fading() && !consoles.anything_waits();
        if ((due && wait_ns == 0) || stage.busy())
            work = queue.try_pop();
        else if (refining)
            work = queue.pop_for(std::chrono::nanoseconds(0));
        else if (stage.frames_in_flight())
            work = queue.pop_for(std::chrono::milliseconds(1));
        else
            work = queue.pop_for(std::chrono::nanoseconds(std::min(
                {due ? wait_ns
                 : stage.fading()
                     ? std::clamp<std::int64_t>(last_moved_ns + frame_time.count() - now, 0, frame_time.count())
                     : std::int64_t{250'000'000},
                 consoles.sleep_ns(now), due ? wait_ns : hands.sleep_ns(now), feed.rest_in_ns(now),
                 std::max<std::int64_t>(stage.rest_in_ns(), 1'000'000)})));
        const std::int64_t drained_ns = monotonic_ns();
        for (; work; work = queue.try_pop()) stage.take(std::move(*work));
        consoles.serve(stage, drained_ns);
        // Hands and fades move the scene right before a frame, so that it holds the newest; without one as often.
        const bool starts = due && wait_ns == 0;
        if (starts || (!due && drained_ns - last_moved_ns >= frame_time.count())) {
            last_moved_ns = drained_ns;
            stage.advance_fade(drained_ns);
            hands.serve(stage, drained_ns);
        }

        if (auto changed = demands.try_take()) {
            demand = std::move(*changed);
            feed.want(demand.lanes, demand.jpeg, demand.jpeg_clients);
        }
        if (starts && (stage.frame_wanted() || stage.report_wanted())) {
            last_begin_ns = drained_ns;
            stage.begin_frame(drained_ns);
        }
        const bool more = stage.frame_wanted() && viewer;
        stage.finish_frames(!more && stage.frames_in_flight());
        // A viewer that joined or fell behind is served from the newest picture, as a key frame.
        feed.serve(monotonic_ns(), more, stage.complete());
        stage.continue_work();
        if (refining && stage.refinable() && !stage.busy()) stage.refine();  // what was drained may have changed it
        if (context && context->lost()) throw std::runtime_error("the GPU lost the GL context");
    }
    // What was declared last ends first: loader and encoder are joined while the front they speak to still stands.
    spdlog::info("stopping");
    return 0;
}

}  // namespace gonio
