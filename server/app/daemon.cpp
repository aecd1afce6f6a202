#include "server/app/daemon.h"

#include <malloc.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <future>
#include <stdexcept>
#include <thread>

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include "client/web/page.h"
#include "server/app/http_options.h"
#include "server/app/reload.h"
#include "server/app/service.h"
#include "server/app/signals.h"
#include "server/app/start.h"
#include "server/app/stream_out.h"
#include "server/base/atomic_file.h"
#include "server/http/http_server.h"
#include "server/http/upload_store.h"
#include "server/session/consoles.h"
#include "server/session/gpu.h"
#include "server/session/render_loop.h"
#include "server/session/render_session.h"
#include "server/session/surface_input.h"
#include "server/show/state_file.h"
#include "server/stream/lane_feed.h"

namespace gonio {
namespace {

constexpr std::uint32_t kReconnectAfterMs = 1000;   // a service is started again by then
constexpr std::chrono::milliseconds kDiscard{100};  // for the private folder, where the end does not wait

// What the signals' thread is told of, until this ends.
template <typename T>
struct Forgotten {
    std::atomic<std::shared_ptr<T>>& slot;
    explicit Forgotten(std::atomic<std::shared_ptr<T>>& kept) : slot(kept) {}
    ~Forgotten() { slot.store({}); }
};

// The end does not wait for a disk that hangs either.
void discard_uploads(const std::shared_ptr<UploadStore>& uploads) {
    auto done = std::make_shared<std::promise<void>>();
    std::thread([uploads, done] {
        uploads->discard(kDiscard);
        done->set_value();
    }).detach();
    done->get_future().wait_for(kDiscard + kDiscard / 2);
}

// Disks that never answer, for tests (`--inject state-hangs`, `--inject reload-hangs`).
Result<bool> write_for_ever(const std::string&, std::string_view) {
    for (;;) std::this_thread::sleep_for(std::chrono::hours(1));
}
Reread read_for_ever() {
    for (;;) std::this_thread::sleep_for(std::chrono::hours(1));
}

// Nothing is reloaded into an HTTP server that ends.
struct EndOfReloading {
    Reloading& reloading;
    ~EndOfReloading() { reloading.end(); }
};

// The GL context is lost. Result: whether there is another, with a renderer; not where the program shall end.
bool renew(Gpu& gpu, RenderSession& render_session, HttpServer& http_server, Queue<Work>& queue) {
    spdlog::warn("gpu: the GL context is lost; everything in it is made anew");
    http_server.set_ready(false);
    render_session.drop_renderer();
    auto renderer = gpu.rebuild([&] {
        for (int i = 0; i < 20 && !queue.closed(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(50));
        return !queue.closed();
    });
    if (!renderer) return false;
    render_session.set_renderer(std::move(renderer));
    http_server.set_ready(true);
    return true;
}

}  // namespace

int run_daemon(const Options& given) {
    // Scenes are large and go: what is larger than this is given back at once. Left alone glibc would raise the bound
    // to 32 MiB and keep what lies below. Frames of up to 1920×1080 are smaller: their pages are not to be made anew.
    ::mallopt(M_MMAP_THRESHOLD, 4 << 20);
    ::mallopt(M_TRIM_THRESHOLD, 16 << 20);
    Options options = given;
    options.state_file = behind_links(std::move(options.state_file));
    const bool serves = options.oneshot.empty();
    if (serves) Signals::block();
    spdlog::set_default_logger(spdlog::stderr_logger_mt("goniod"));
    set_log_level(options.log_level);
    std::string token_warning;
    const auto tokens = read_tokens(options, &token_warning);
    if (!tokens) throw std::runtime_error(tokens.error().text());
    if (!token_warning.empty()) spdlog::warn("{}", token_warning);
    Inbox inbox;
    Queue<Work>& queue = inbox.queue;
    std::atomic<std::shared_ptr<HttpServer>> front_to_stop;
    std::atomic<std::shared_ptr<StateFile>> state_to_save;
    std::atomic<std::shared_ptr<UploadStore>> uploads_to_discard;
    const auto hangs = [&](const char* fault) {
        return std::ranges::find(options.inject, fault) != options.inject.end();
    };
    const bool state_hangs = hangs("state-hangs");
    Reloading reloading(hangs("reload-hangs") ? read_for_ever
                                              : std::function([options] { return read_again(options); }));
    // Declared first, it ends last: it bounds the time that the others take.
    std::optional<Signals> signals;
    const Forgotten forgotten_uploads(uploads_to_discard);  // the folder goes while the signals still watch
    if (serves)
        signals.emplace(Signals::Actions{[&] {
                                             if (const auto stopping = front_to_stop.load()) stopping->stop_accepting();
                                             queue.close();
                                         },
                                         [&] {
                                             if (const auto stopping = front_to_stop.load())
                                                 stopping->stop(kReconnectAfterMs);
                                         },
                                         [&] {
                                             const auto saving = state_to_save.load();
                                             if (saving) saving->close_within(std::chrono::milliseconds(100));
                                         },
                                         [&] {
                                             if (const auto store = uploads_to_discard.load()) discard_uploads(store);
                                         },
                                         [&] { reloading.ask(); }});
    std::optional<FileLock> show_lock;
    if (serves && !options.state_file.empty()) {
        auto taken = FileLock::take(options.state_file);
        if (!taken) throw std::runtime_error(taken.error().text());
        if (const std::string why = taken->why_not(); !why.empty())
            spdlog::warn("state: {}.lock cannot be held: {}; nothing keeps another server from this show",
                         options.state_file, why);
        show_lock.emplace(std::move(*taken));
    }
    std::optional<Scene> scene;
    SurfaceOptions boxes;
    GpuFaults faults;
    try {
        scene = first_scene(options);
        boxes = surface_options(options);
        for (const std::string& fault : options.inject)
            if (fault != "state-hangs" && fault != "reload-hangs") add_fault(faults, fault);
    } catch (const std::invalid_argument& error) {
        std::fprintf(stderr, "goniod: %s\n", error.what());
        return 2;
    }
    if (!serves) return run_job(options, std::move(*scene));
    Gpu gpu(gpu_maker(options), faults);
    spdlog::info("{}", gpu.context() ? gpu.context()->description() : "no GL: grey pictures (--renderer null)");
    const std::string renderer_name = gpu.context() ? gpu.context()->renderer() : "null";

    std::shared_ptr<UploadStore> uploads;  // before the HTTP server that writes them
    if (options.limits.upload_bytes > 0) {
        auto opened = UploadStore::open(options.upload_folder, options.limits);
        if (!opened) throw std::runtime_error(opened.error().text());
        uploads = std::move(*opened);
        uploads_to_discard = uploads;
    }
    std::shared_ptr<HttpServer> http_server;
    LaneEncoders encoders(encoder_setup(options, scene->width_px, scene->height_px),
                          encoder_outputs(http_server, [&queue] { queue.wake(Queue<Work>::Wake::soon); }));
    LaneFeed feed(encoders);
    auto metrics = std::make_shared<Metrics>();
    metrics->gauge("build_info", "The program's version.", "version=\"" GONIO_VERSION "\"").set(1);
    Histogram& render_seconds =
        metrics->histogram("render_seconds", "From draining the commands to the picture in memory.");
    Histogram& readback_seconds = metrics->histogram(
        "readback_seconds", "What the render thread waits for a picture's last passes and copies it to memory.");
    Counter& rendered = metrics->counter("frames_rendered_total", "Pictures that left the renderer.");
    Counter& gpu_resets = metrics->counter("gpu_resets_total", "GL contexts that were lost and made anew.");
    Counter& saves = metrics->counter("state_saves_total", "Shows that were written to the state file.");
    Gauge& scene_rev = metrics->gauge("scene_revision", "Of the scene.");
    HttpOptions listen = front_options(options);
    listen.metrics = metrics;
    listen.uploads = uploads.get();
    listen.tokens = *tokens;
    listen.server_name = "goniod " GONIO_VERSION;
    listen.renderer = renderer_name;
    listen.encoder = encoders.encoder();
    listen.page = page_files();
    auto started = HttpServer::start(listen, inbox.callbacks());
    if (!started) throw std::runtime_error(started.error().text());
    http_server = std::move(*started);
    // Before all else at the end: what the HTTP server speaks to goes after it.
    const Forgotten forgotten_front(front_to_stop);
    front_to_stop = http_server;
    const EndOfReloading end_of_reloading{reloading};
    reloading.begin([serving = http_server.get()](const Reread& reread) { use_again(reread, *serving); });
    Service service;  // ends before the HTTP server that it asks

    std::unique_ptr<Inputs> inputs;
    if (options.inputs.any()) {
        auto opened = Inputs::start(options.inputs, [&] { queue.wake(); });
        if (!opened) throw std::runtime_error(opened.error().text());
        inputs = std::move(*opened);
    }
    const auto frame_time = std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 / options.target_fps));
    Consoles consoles(inputs.get(), frame_time.count());
    std::unique_ptr<ControlSurfaces> surfaces;
    if (boxes.on || boxes.replay) {
        auto opened = ControlSurfaces::start(boxes, [&] { queue.wake(); });
        if (!opened) throw std::runtime_error(opened.error().text());
        surfaces = std::move(*opened);
    }
    SurfaceInput hands(surfaces.get(), frame_time.count(), [&](std::uint32_t session, v1::ServerMessage message) {
        http_server->reply(session, std::move(message));
    });
    RenderSession* running = nullptr;  // for what is asked about the scene

    Loader loader;
    std::shared_ptr<StateFile> state_file;
    if (!options.state_file.empty())
        state_file = std::make_shared<StateFile>(options.state_file, kSaveInterval, kSaveRetry, kMaxSavedBytes,
                                                 state_hangs ? write_for_ever : write_file_atomically);
    state_to_save = state_file;
    RenderSession render_session(
        gpu.take_renderer(), std::move(*scene), renderer_name, queue, loader,
        {
            [&](std::uint32_t session, v1::ServerMessage message) { http_server->reply(session, std::move(message)); },
            [&](v1::State state, v1::StateChanged change) {
                scene_rev.set(state.scene_rev());
                consoles.publish_state(state);
                http_server->publish_state(std::move(state));
                http_server->broadcast(std::move(change));
                if (state_file) state_file->put(running->scene());
            },
            [&](Picture picture) {
                gpu.picture_done();
                hands.picture_out(picture.scene_rev, picture.rendered_ns);
                rendered.add();
                render_seconds.observe(static_cast<double>(picture.rendered_ns - picture.drained_ns) * 1e-9);
                readback_seconds.observe(static_cast<double>(picture.readback_ns) * 1e-9);
                feed.show(std::move(picture), monotonic_ns());
            },
            [&] {
                v1::Stats stats;
                add_lane_figures(stats, encoders, feed, inbox.demand.jpeg_clients, monotonic_ns());
                stats.set_packets_sent(http_server->packets_sent());
                stats.set_clients(inbox.demand.clients);
                if (state_file) {
                    stats.set_state_saves(state_file->told().saves);
                    stats.set_state_error(state_file->told().error);
                    stats.set_state_unsaved_s(state_file->told().unsaved_s);
                }
                return stats;
            },
            [&] { return consoles.sources(); },
            [&] { return hands.describe(running->scene()); },
            [&](std::uint32_t session, std::uint32_t request_id, double timeout_s) {
                hands.learn(session, request_id, timeout_s);
            },
            [&](std::uint32_t session) { hands.forget_session(session); },
            [&] { return gpu.lost(); },
        });
    if (options.keep_up) render_session.set_budget(1e3 / options.target_fps);
    render_session.set_most_captures(options.max_captures);
    render_session.set_scene_access({is_loopback(options.host), options.scene_roots, uploads ? uploads->folder() : "",
                                     options.max_albedo, options.max_memory});
    scene_rev.set(render_session.scene().scene_rev);
    running = &render_session;
    http_server->publish_state(render_session.state());
    consoles.publish_state(render_session.state());
    if (state_file) state_file->put(render_session.scene());  // whether it can be written is known at the start

    // READY means: a first frame has been rendered and encoded, so that whoever connects sees a picture at once.
    render_session.begin_frame(monotonic_ns());
    render_session.finish_frames(true);
    const LaneId first_lane = options.max_private_lanes > 0 ? kFirstPrivateLane : kSharedLane;
    encoders.encode_first(first_lane, feed.newest());
    feed.tried(first_lane);
    http_server->set_ready(true);
    service.tell("READY=1");
    service.watch([&](std::function<void()> call) { http_server->post(std::move(call)); });
    std::printf("READY %s://%s:%u\n", http_server->secure() ? "https" : "http",
                options.host.find(':') == std::string::npos ? options.host.c_str() : ("[" + options.host + "]").c_str(),
                http_server->port());
    std::fflush(stdout);

    RenderLoop loop(inbox, render_session, feed, consoles, hands, frame_time);
    while (!queue.closed()) {
        service.render();
        http_server->came_by();
        loop.turn();
        if (state_file) saves.add(state_file->told().saves - saves.value());
        if (!gpu.lost()) continue;
        gpu_resets.add();
        if (!renew(gpu, render_session, *http_server, queue)) break;
    }
    http_server->set_ready(false);
    service.tell("STOPPING=1");
    // What was taken in before the signal is carried out and answered; then clients are told.
    while (auto work = queue.try_pop()) render_session.take(std::move(*work));
    http_server->stop(kReconnectAfterMs);
    if (state_file) state_file->close();
    // What was declared last ends first: loader and encoder are joined while the HTTP server they speak to still
    // stands.
    spdlog::info("stopping");
    return 0;
}

}  // namespace gonio
