#include "server/app/app.h"

#include <malloc.h>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <future>
#include <random>
#include <stdexcept>
#include <thread>

#include <spdlog/spdlog.h>

#include "client/web/page.h"
#include "protocol/schema/session.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/app/http_options.h"
#include "server/app/log.h"
#include "server/app/stop_on_signal.h"
#include "server/base/threads.h"
#include "server/lighting/isa.h"
#include "server/scene/scene.h"
#include "server/session/command_files.h"

namespace gonio {
namespace {

constexpr std::uint32_t kReconnectAfterMs = 1000;   // a service is started again by then
constexpr std::uint32_t kAnewAfterMs = 100;         // for clients of a server whose leader began again
constexpr std::chrono::milliseconds kDiscard{100};  // for the private folder, where the end does not wait
constexpr const char* kStateHangs = "state-hangs";
constexpr const char* kReloadHangs = "reload-hangs";

bool injects(const Options& options, const char* fault) {
    return std::ranges::find(options.inject, fault) != options.inject.end();
}

// Disks that never answer, for tests.
Result<bool> write_for_ever(const std::string&, std::string_view) {
    for (;;) std::this_thread::sleep_for(std::chrono::hours(1));
}
Reread read_for_ever() {
    for (;;) std::this_thread::sleep_for(std::chrono::hours(1));
}

template <typename T>
T value_of(Result<T> result) {
    if (!result) throw std::runtime_error(result.error().text());
    return std::move(*result);
}

std::optional<FileLock> lock_show(const std::string& file) {
    if (file.empty()) return std::nullopt;
    FileLock lock = value_of(FileLock::take(file));
    if (const std::string why = lock.why_not(); !why.empty())
        spdlog::warn("state: {}.lock cannot be held: {}; nothing keeps another server from this show", file, why);
    return lock;
}

// Result: another one in each run of the program.
std::string fresh_name() {
    std::random_device random;
    char digits[17];
    std::snprintf(digits, sizeof digits, "%08x%08x", random(), random());
    return digits;
}

// An option, or a file that one names, cannot be used.
struct BadOption : std::invalid_argument {
    using std::invalid_argument::invalid_argument;
};

// Throws BadOption.
Beginning beginning(const Options& options) {
    try {
        Beginning first;
        first.scene = options.follow.empty() ? first_scene(options, &first.restored_rev, &first.undo)
                                             : unheard_scene(options.follow);
        first.surfaces = surface_options(options);
        for (const std::string& fault : options.inject)
            if (fault != kStateHangs && fault != kReloadHangs) add_fault(first.faults, fault);
        return first;
    } catch (const std::invalid_argument& error) {
        throw BadOption(error.what());
    }
}

}  // namespace

RenderMetrics::RenderMetrics(Metrics& metrics)
    : render_seconds(metrics.histogram("render_seconds", "From draining the commands to the picture in memory.")),
      readback_seconds(metrics.histogram(
          "readback_seconds", "What the render thread waits for a picture's last passes and copies it to memory.")),
      frames_rendered(metrics.counter("frames_rendered_total", "Pictures that left the renderer.")),
      gpu_resets(metrics.counter("gpu_resets_total", "GL contexts that were lost and made anew.")),
      saves(metrics.counter("state_saves_total", "Shows that were written to the state file.")),
      scene_revision(metrics.gauge("scene_revision", "Of the scene.")) {
    metrics.gauge("build_info", "The program's version.", "version=\"" GONIO_VERSION "\"").set(1);
}

App::App(Options options, Tokens tokens)
    : options_(std::move(options)),
      tokens_(std::move(tokens)),
      reloading_(injects(options_, kReloadHangs) ? read_for_ever
                                                 : std::function<Reread()>(std::bind_front(read_again, options_))),
      show_lock_(lock_show(options_.state_file)),
      first_(beginning(options_)) {
    if (options_.keep_up) render_session_.set_budget(1e3 / options_.target_fps);
    render_session_.set_most_captures(options_.max_captures);
    render_session_.set_scene_access({is_loopback(options_.host), options_.scene_roots,
                                      uploads_ ? uploads_->folder() : "", options_.load, options_.max_memory,
                                      show_folder(options_), render_session_.scene().gels});
    const std::string boot = fresh_name();
    render_session_.set_boot(boot, first_.restored_rev);
    auto library = std::make_shared<Library>(options_.library_folders, uploads_ ? uploads_->folder() : "");
    library->keep_scene(profiles_of(render_session_.scene()));
    render_session_.set_library(std::move(library));
    render_session_.go_on(first_.undo);
    read_lefts();
    first_.undo = {};  // undo has it, and what it drops is to be free
    if (options_.follow.empty()) return;
    render_session_.set_leader(options_.follow);
    follower_ = std::make_unique<Follower>(follow_options(boot), render_session_.scene(), inbox_.queue, *metrics_);
}

FollowOptions App::follow_options(const std::string& boot) const {
    FollowOptions follow;
    follow.url = options_.follow;
    follow.leader = value_of(parse_server_url(options_.follow));
    follow.leader.ca_file = options_.follow_ca;
    follow.token = [file = options_.follow_token_file] { return token_of_file(file, nullptr, "--follow-token-file"); };
    follow.boot = boot;
    follow.folder = uploads_->folder();
    follow.file_bytes = options_.limits.upload_bytes;
    follow.all_bytes = options_.limits.upload_total_bytes;
    follow.load = options_.load;
    follow.max_memory = options_.max_memory;
    return follow;
}

std::string App::name_renderer() const {
    const gl::Context* const context = gpu_.context();
    spdlog::info("{}", context ? context->description() : "no GL: grey pictures (--renderer null)");
    return context ? context->renderer() : "null";
}

std::shared_ptr<UploadStore> App::open_uploads() {
    if (options_.limits.upload_bytes == 0) return nullptr;
    std::shared_ptr<UploadStore> uploads = value_of(UploadStore::open(options_.upload_folder, options_.limits));
    uploads_to_discard_.store(uploads);
    return uploads;
}

HttpOptions App::http_options() const {
    HttpOptions listen;
    listen.host = options_.host;
    listen.port = options_.port;
    listen.limits = options_.limits;
    listen.tls_certificate = options_.tls_certificate;
    listen.tls_key = options_.tls_key;
    listen.host_names = options_.host_names;
    listen.origins = options_.origins;
    listen.private_lanes = options_.max_private_lanes;
    listen.metrics = metrics_;
    listen.leader = options_.follow;
    listen.uploads = uploads_.get();
    listen.tokens = tokens_;
    listen.server_name = "goniod " GONIO_VERSION;
    listen.renderer = renderer_name_;
    listen.encoder = encoders_.encoder();
    listen.page = page_files();
    return listen;
}

App::Listening::Listening(App& of) : app(of) {
    app.http_server_ = value_of(HttpServer::start(app.http_options(), app.inbox_.callbacks()));
    app.server_to_stop_.store(app.http_server_);
    app.reloading_.begin([&server = *app.http_server_](const Reread& reread) { use_again(reread, server); });
}

App::Listening::~Listening() {
    app.reloading_.end();
    app.server_to_stop_.store({});
}

std::unique_ptr<Inputs> App::start_inputs() {
    if (!options_.inputs.any()) return nullptr;
    return value_of(Inputs::start(options_.inputs, waker(Queue<Work>::Wake::now)));
}

std::unique_ptr<ControlSurfaces> App::start_surfaces() {
    if (!first_.surfaces.on && !first_.surfaces.replay) return nullptr;
    return value_of(ControlSurfaces::start(first_.surfaces, waker(Queue<Work>::Wake::now)));
}

std::shared_ptr<StateFile> App::open_state_file() {
    if (options_.state_file.empty()) return nullptr;
    const auto to_disk = injects(options_, kStateHangs) ? write_for_ever : write_file_atomically;
    auto file = std::make_shared<StateFile>(options_.state_file, kSaveInterval, kSaveRetry, kMaxSavedBytes, to_disk);
    show_to_save_.store(file);
    return file;
}

std::function<void()> App::waker(Queue<Work>::Wake when) {
    return std::bind_front(&Queue<Work>::wake, &inbox_.queue, when);
}

Signals::Actions App::signal_actions() {
    return {.stop = std::bind_front(&App::let_nobody_in, this),
            .farewell = std::bind_front(&App::say_goodbye, this),
            .last = std::bind_front(&App::save_show, this),
            .discard = std::bind_front(&App::discard_uploads, this),
            .reload = std::bind_front(&Reloading::ask, &reloading_)};
}

void App::let_nobody_in() {
    if (const auto server = server_to_stop_.load()) server->stop_accepting();
    inbox_.queue.close();
}

void App::say_goodbye() {
    if (const auto server = server_to_stop_.load()) server->stop(kReconnectAfterMs);
}

void App::save_show() {
    if (const auto file = show_to_save_.load()) file->close_within(std::chrono::milliseconds(100));
}

// The end does not wait for a disk that hangs either.
void App::discard_uploads() {
    const auto uploads = uploads_to_discard_.load();
    if (!uploads) return;
    auto done = std::make_shared<std::promise<void>>();
    std::thread([uploads, done] {
        uploads->discard(kDiscard);
        done->set_value();
    }).detach();
    done->get_future().wait_for(kDiscard + kDiscard / 2);
}

SessionOutputs App::session_outputs() {
    return {.reply = std::bind_front(&App::reply, this),
            .state = std::bind_front(&App::tell_state, this),
            .blobs = [this](std::shared_ptr<const Blobs> blobs) { http_server_->publish_blobs(std::move(blobs)); },
            .picture = std::bind_front(&App::show_picture, this),
            .counters = std::bind_front(&App::stats, this),
            .sources = std::bind_front(&App::describe_sources, this),
            .surfaces = std::bind_front(&App::describe_surfaces, this),
            .learn = std::bind_front(&SurfaceInput::learn, &surface_input_),
            .gone = std::bind_front(&SurfaceInput::forget_session, &surface_input_),
            .gpu_lost = std::bind_front(&Gpu::lost, &gpu_)};
}

void App::reply(std::uint32_t session, v1::ServerMessage message) {
    add_place(message, file_place_.get());
    http_server_->reply(session, std::move(message));
}

// Consoles have the scene's own positions, clients those of its file.
void App::publish_state(v1::State state) {
    consoles_.publish_state(state);
    add_place(state, file_place_.get());
    http_server_->publish_state(std::move(state));
}

void App::tell_state(v1::State state, v1::StateChanged change) {
    counted_.scene_revision.set(state.scene_rev());
    file_place_.set(render_session_.scene().asset->place);
    publish_state(std::move(state));
    add_place(change, file_place_.get());
    http_server_->broadcast(std::move(change));
    save_state();
    if (follower_) http_server_->set_ready(true);  // it has its leader's show
}

void App::save_state() {
    if (state_file_) state_file_->put(render_session_.scene(), render_session_.undo_record());
}

// The last one first, which undo gets to first.
void App::read_lefts() {
    for (auto left = first_.undo.earlier.rbegin(); left != first_.undo.earlier.rend(); ++left)
        loader_.submit([this, kept = *left, gels = render_session_.scene().gels] {
            lefts_.push({kept, read_left(options_, *kept, gels)});
            inbox_.queue.wake(Queue<Work>::Wake::soon);
        });
}

void App::take_lefts() {
    while (auto read = lefts_.try_pop()) render_session_.take_read(read->first, std::move(read->second));
}

void App::show_picture(Picture picture) {
    gpu_.picture_done();
    surface_input_.picture_out(picture.scene_rev, picture.rendered_ns);
    counted_.frames_rendered.add();
    counted_.render_seconds.observe(static_cast<double>(picture.rendered_ns - picture.drained_ns) * 1e-9);
    counted_.readback_seconds.observe(static_cast<double>(picture.readback_ns) * 1e-9);
    feed_.show(std::move(picture), monotonic_ns());
}

v1::Stats App::stats() {
    v1::Stats stats;
    add_lane_figures(stats, encoders_, feed_, inbox_.demand.jpeg_clients, monotonic_ns());
    stats.set_packets_sent(http_server_->packets_sent());
    stats.set_clients(inbox_.demand.clients);
    if (!state_file_) return stats;
    stats.set_state_saves(state_file_->told().saves);
    stats.set_state_error(state_file_->told().error);
    stats.set_state_unsaved_s(state_file_->told().unsaved_s);
    return stats;
}

void App::start() {
    counted_.scene_revision.set(render_session_.scene().scene_rev);
    file_place_.set(render_session_.scene().asset->place);
    publish_state(render_session_.state());
    save_state();  // whether it can be written is known at the start
    // READY means: a first frame has been rendered and encoded, so that whoever connects sees a picture at once.
    render_session_.begin_frame(monotonic_ns());
    render_session_.finish_frames(true);
    const LaneId first_lane = options_.max_private_lanes > 0 ? kFirstPrivateLane : kSharedLane;
    encoders_.encode_first(first_lane, feed_.newest());
    feed_.tried(first_lane);
    http_server_->set_ready(!follower_);
    service_.tell("READY=1");
    service_.watch(std::bind_front(&HttpServer::post, http_server_.get()), [this] {
        const auto [given, done] = encoders_.turns();
        return Service::Encoding{given, done};
    });
    const bool plain = options_.host.find(':') == std::string::npos;
    std::printf("READY %s://%s:%u\n", http_server_->secure() ? "https" : "http",
                plain ? options_.host.c_str() : ("[" + options_.host + "]").c_str(), http_server_->port());
    std::fflush(stdout);
}

// Between two attempts. Result: whether there shall be another.
bool App::pause() const {
    for (int i = 0; i < 20 && !inbox_.queue.closed(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(50));
    return !inbox_.queue.closed();
}

// lost: the GL context is. Result: whether there is another, with a renderer; not where the program shall end.
bool App::renew_gpu(const char* why, bool lost) {
    if (lost) counted_.gpu_resets.add();
    spdlog::warn("gpu: {}; everything in it is made anew", why);
    http_server_->set_ready(false);
    render_session_.drop_renderer();
    auto renderer = gpu_.rebuild(std::bind_front(&App::pause, this), lost);
    if (!renderer) return false;
    render_session_.set_renderer(std::move(renderer));
    http_server_->set_ready(true);
    return true;
}

// The leader's revisions began again, and with them all that goes by revisions. Result: as of renew_gpu().
bool App::begin_anew() {
    if (!renew_gpu("the leader's revisions began again", false)) return false;
    render_session_.begin_anew();
    http_server_->send_away(kAnewAfterMs);
    return true;
}

void App::run() {
    while (!inbox_.queue.closed()) {
        service_.render();
        http_server_->came_by();
        loop_.turn();
        take_lefts();
        if (state_file_) counted_.saves.add(state_file_->told().saves - counted_.saves.value());
        if (gpu_.lost() && !renew_gpu("the GL context is lost", true)) return;
        if (render_session_.begins_anew() && !begin_anew()) return;
    }
}

void App::stop() {
    spdlog::info("stopping");
    http_server_->set_ready(false);
    service_.tell("STOPPING=1");
    // What was taken in before the signal is carried out and answered; then clients are told.
    while (auto work = inbox_.queue.try_pop()) render_session_.take(std::move(*work));
    http_server_->stop(kReconnectAfterMs);
    if (state_file_) state_file_->close();
}

int run_daemon(const Options& given) {
    // Scenes are large and go: what is larger than this is given back at once. Left alone glibc would raise the bound
    // to 32 MiB and keep what lies below. Frames of up to 1920×1080 are smaller: their pages are not to be made anew.
    ::mallopt(M_MMAP_THRESHOLD, 4 << 20);
    ::mallopt(M_TRIM_THRESHOLD, 16 << 20);
    Options options = given;
    options.state_file = behind_links(std::move(options.state_file));
    const bool serves = options.serves();
    if (serves)
        Signals::block();
    else
        StopOnSignal::block();
    set_thread_count(options.threads);
    start_log(options);
    std::string token_warning;
    Tokens tokens = value_of(read_tokens(options, &token_warning));
    if (!token_warning.empty()) spdlog::warn("{}", token_warning);
    try {
        if (const auto used = lighting::use_isa(options.isa); !used) throw BadOption(used.error().text());
        if (!serves) return run_job(options, beginning(options).scene);
        App app(std::move(options), std::move(tokens));
        app.start();
        app.run();
        app.stop();
        return 0;
    } catch (const BadOption& error) {
        log_end(given, error.what());
        return given.bake.scene.empty() ? 2 : 1;  // a bake has 2 for its words alone
    }
}

}  // namespace gonio
