#include "server/daemon.h"

#include <atomic>
#include <cstdio>
#include <fstream>
#include <set>
#include <stdexcept>
#include <thread>

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include "client/web/page.h"
#include "server/consoles.h"
#include "server/front_options.h"
#include "server/gpu.h"
#include "server/net/front.h"
#include "server/net/upload_store.h"
#include "server/null_renderer.h"
#include "server/oneshot.h"
#include "server/reload.h"
#include "server/render/renderer.h"
#include "server/service.h"
#include "server/signals.h"
#include "server/stage.h"
#include "server/start.h"
#include "server/state_file.h"
#include "server/stream/lane_feed.h"
#include "server/stream_out.h"
#include "server/surface_hands.h"

namespace gonio {
namespace {

Renderer::Gather gather_of(const Options& options) {
    return options.gather == "gl"     ? Renderer::Gather::gl
           : options.gather == "simd" ? Renderer::Gather::simd
                                      : Renderer::Gather::automatic;
}

// Result: what makes the context and its renderer, at the start and after a loss.
std::function<Gpu::Made()> gpu_maker(const Options& options) {
    return [options] {
        Gpu::Made made;
        if (options.renderer == "null") {
            made.renderer = std::make_unique<NullRenderer>();
            return made;
        }
        made.context = gl::Context::create({options.device, options.gl_debug});
        made.renderer = std::make_unique<Renderer>(*made.context, gather_of(options));
        return made;
    };
}

constexpr std::uint32_t kReconnectAfterMs = 1000;  // a service is started again by then

}  // namespace

int run_daemon(const Options& options) {
    const bool serves = options.oneshot.empty();
    if (serves) Signals::block();
    spdlog::set_default_logger(spdlog::stderr_logger_mt("goniod"));
    set_log_level(options);
    std::string token_warning;
    const auto token = read_token(options.token_file, &token_warning);
    if (!token) throw std::runtime_error(token.error().text());
    if (!token_warning.empty()) spdlog::warn("{}", token_warning);
    Queue<Work> queue(kMaxWork);
    Latest<std::set<SessionId>> left;  // sessions whose end found the queue full
    std::atomic<std::shared_ptr<Front>> front_to_stop;
    std::atomic<std::shared_ptr<StateFile>> state_to_save;
    // Declared first, it ends last: it bounds the time that the others take.
    std::optional<Signals> signals;
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
                                             if (const auto saving = state_to_save.load()) saving->close();
                                         },
                                         [&] {
                                             if (const auto serving = front_to_stop.load()) reload(options, *serving);
                                         }});
    std::optional<Scene> scene;
    SurfaceOptions boxes;
    GpuFaults faults;
    try {
        scene = first_scene(options);
        boxes = surface_options(options);
        for (const std::string& fault : options.inject) add_fault(faults, fault);
    } catch (const std::invalid_argument& error) {
        std::fprintf(stderr, "goniod: %s\n", error.what());
        return 2;
    }
    if (!serves) {
        if (options.renderer == "null") throw std::runtime_error("--oneshot needs --renderer gl");
        const auto context = gl::Context::create({options.device, options.gl_debug});
        spdlog::info("{}", context->description());
        Renderer renderer(*context, gather_of(options));
        return run_oneshot(renderer, std::move(*scene), options.oneshot, options.out);
    }
    Gpu gpu(gpu_maker(options), faults);
    spdlog::info("{}", gpu.context() ? gpu.context()->description() : "no GL: grey pictures (--renderer null)");
    const std::string renderer_name = gpu.context() ? gpu.context()->renderer() : "null";

    std::unique_ptr<UploadStore> uploads;  // before the front that writes them
    if (options.limits.upload_bytes > 0) {
        auto opened = UploadStore::open(options.upload_folder, options.limits);
        if (!opened) throw std::runtime_error(opened.error().text());
        uploads = std::move(*opened);
    }
    Latest<Demand> demands;
    std::shared_ptr<Front> front;
    LaneEncoders encoders(encoder_setup(options, scene->width_px, scene->height_px),
                          encoder_outputs(front, [&queue] { queue.wake(); }));
    LaneFeed feed(encoders);
    auto metrics = std::make_shared<Metrics>();
    metrics->gauge("build_info", "The program's version.", "version=\"" GONIO_VERSION "\"").set(1);
    Histogram& render_seconds =
        metrics->histogram("render_seconds", "From draining the commands to the picture in memory.");
    Counter& rendered = metrics->counter("frames_rendered_total", "Pictures that left the renderer.");
    Gauge& scene_rev = metrics->gauge("scene_revision", "Of the scene.");
    FrontOptions listen;
    listen.metrics = metrics;
    listen.uploads = uploads.get();
    listen.limits = options.limits;
    listen.tls_certificate = options.tls_certificate;
    listen.tls_key = options.tls_key;
    listen.host_names = options.host_names;
    listen.origins = options.origins;
    listen.host = options.host;
    listen.port = options.port;
    listen.token = *token;
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
                                     if (queue.push(std::move(gone))) return;
                                     left.merge([&](std::set<SessionId>& sessions) { sessions.insert(session); });
                                     queue.wake();
                                 },
                                 [&](SessionId session, v1::Identify identify) {
                                     Work work;
                                     work.session = session;
                                     *work.message.mutable_identify() = std::move(identify);
                                     return queue.push(std::move(work));
                                 },
                             });
    if (!started) throw std::runtime_error(started.error().text());
    front = std::move(*started);
    // Before all else at the end: what the front speaks to goes after it.
    struct Forgotten {
        std::atomic<std::shared_ptr<Front>>& slot;
        explicit Forgotten(std::atomic<std::shared_ptr<Front>>& kept) : slot(kept) {}
        ~Forgotten() { slot.store({}); }
    } forgotten(front_to_stop);
    front_to_stop = front;
    Service service;  // ends before the front that it asks

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
    std::shared_ptr<StateFile> state_file;
    if (!options.state_file.empty()) state_file = std::make_shared<StateFile>(options.state_file);
    state_to_save = state_file;
    Stage stage(
        gpu.take_renderer(), std::move(*scene), renderer_name, queue, loader,
        {
            [&](std::uint32_t session, v1::ServerMessage message) { front->reply(session, std::move(message)); },
            [&](v1::State state, v1::StateChanged change) {
                scene_rev.set(state.scene_rev());
                consoles.publish_state(state);
                front->publish_state(std::move(state));
                front->broadcast(std::move(change));
                if (state_file) state_file->put(running->scene());
            },
            [&](Picture picture) {
                gpu.picture_done();
                hands.picture_out(picture.scene_rev, picture.rendered_ns);
                rendered.add();
                render_seconds.observe(static_cast<double>(picture.rendered_ns - picture.drained_ns) * 1e-9);
                feed.show(std::move(picture), monotonic_ns());
            },
            [&] {
                v1::Stats stats;
                add_lane_figures(stats, encoders, feed, demand.jpeg_clients, monotonic_ns());
                stats.set_packets_sent(front->packets_sent());
                stats.set_clients(demand.clients);
                if (state_file) {
                    stats.set_state_saves(state_file->told().saves);
                    stats.set_state_error(state_file->told().error);
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
    if (options.keep_up) stage.set_budget(1e3 / options.target_fps);
    stage.set_most_captures(options.max_captures);
    stage.set_scene_access({is_loopback(options.host), options.scene_roots, uploads ? uploads->folder() : ""});
    scene_rev.set(stage.scene().scene_rev);
    running = &stage;
    front->publish_state(stage.state());
    consoles.publish_state(stage.state());
    if (state_file) state_file->put(stage.scene());  // whether it can be written is known at the start

    // READY means: a first frame has been rendered and encoded, so that whoever connects sees a picture at once.
    stage.begin_frame(monotonic_ns());
    stage.finish_frames(true);
    const LaneId first_lane = options.max_private_lanes > 0 ? kFirstPrivateLane : kSharedLane;
    encoders.encode_first(first_lane, feed.newest());
    feed.tried(first_lane);
    front->set_ready(true);
    service.tell("READY=1");
    service.watch([&](std::function<void()> call) { front->post(std::move(call)); });
    std::printf("READY %s://%s:%u\n", front->secure() ? "https" : "http",
                options.host.find(':') == std::string::npos ? options.host.c_str() : ("[" + options.host + "]").c_str(),
                front->port());
    std::fflush(stdout);

    std::int64_t last_begin_ns = 0, last_moved_ns = 0;
    while (!queue.closed()) {
        service.render();
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
        const auto sessions_left = left.try_take();  // before what they said is drained
        for (; work; work = queue.try_pop()) stage.take(std::move(*work));
        for (const SessionId session : sessions_left.value_or(std::set<SessionId>())) {
            Work gone;
            gone.session = session;
            gone.closed = true;
            stage.take(std::move(gone));
        }
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
        if (gpu.lost()) {
            spdlog::warn("gpu: the GL context is lost; everything in it is made anew");
            front->set_ready(false);
            stage.drop_renderer();
            auto renderer = gpu.rebuild([&] {
                for (int i = 0; i < 20 && !queue.closed(); ++i)
                    std::this_thread::sleep_for(std::chrono::milliseconds(50));
                return !queue.closed();
            });
            if (!renderer) break;
            stage.set_renderer(std::move(renderer));
            front->set_ready(true);
            continue;
        }
        // A viewer that joined or fell behind is served from the newest picture, as a key frame.
        feed.serve(monotonic_ns(), more, stage.complete());
        stage.continue_work();
        if (refining && stage.refinable() && !stage.busy()) stage.refine();  // what was drained may have changed it
    }
    front->set_ready(false);
    service.tell("STOPPING=1");
    // What was taken in before the signal is carried out and answered; then clients are told.
    while (auto work = queue.try_pop()) stage.take(std::move(*work));
    front->stop(kReconnectAfterMs);
    if (state_file) state_file->close();
    // What was declared last ends first: loader and encoder are joined while the front they speak to still stands.
    spdlog::info("stopping");
    return 0;
}

}  // namespace gonio
