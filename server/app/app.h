// goniod wired together: loader, render, encode and net threads, and what passes between them.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "server/app/reload.h"
#include "server/app/service.h"
#include "server/app/signals.h"
#include "server/app/start.h"
#include "server/app/stream_out.h"
#include "server/base/atomic_file.h"
#include "server/base/shared.h"
#include "server/follow/follower.h"
#include "server/http/upload_store.h"
#include "server/session/file_place.h"
#include "server/session/render_loop.h"
#include "server/show/state_file.h"

namespace gonio {

// Runs until SIGINT or SIGTERM. Result: the exit code (0 ok, 2 bad option or scene). Throws std::runtime_error with one
// sentence where the environment is broken (no GL, port taken).
int run_daemon(const Options& options);

// What options and saved show say; the faults are those of tests.
struct Beginning {
    Scene scene;
    Revision restored_rev = 0;  // State.restored_rev
    UndoRecord undo;            // of the saved show
    SurfaceOptions surfaces;
    GpuFaults faults;
};

// What the render thread counts for /metrics.
struct RenderMetrics {
    explicit RenderMetrics(Metrics& metrics);
    Histogram &render_seconds, &readback_seconds;
    Counter &frames_rendered, &gpu_resets, &saves;
    Gauge& scene_revision;
};

// Render thread, where nothing else is said.
class App {
public:
    // All stands and the HTTP server listens. Throws as run_daemon(), and BadOption. Signals are blocked before it.
    App(Options options, Tokens tokens);
    void start();  // until the first picture can be seen, and READY is said
    void run();    // until SIGINT or SIGTERM. Throws std::runtime_error where no GPU comes back
    void stop();   // answers what was asked before, says goodbye and saves the show

private:
    // What the signals' thread is told of, until this ends.
    struct Forgotten {
        Shared<UploadStore>& uploads;
        ~Forgotten() { uploads.store({}); }
    };
    // While it lives the HTTP server listens, and signals and reloads reach it.
    struct Listening {
        App& app;
        explicit Listening(App& of);
        ~Listening();
    };
    std::string name_renderer() const;
    std::shared_ptr<UploadStore> open_uploads();
    HttpOptions http_options() const;
    std::unique_ptr<Inputs> start_inputs();
    std::unique_ptr<ControlSurfaces> start_surfaces();
    std::shared_ptr<StateFile> open_state_file();
    void save_state();
    void read_lefts();
    void take_lefts();
    std::function<void()> waker(Queue<Work>::Wake when);
    // On the signals' thread.
    Signals::Actions signal_actions();
    void let_nobody_in();
    void say_goodbye();
    void save_show();
    void discard_uploads();
    // Of the render session.
    SessionOutputs session_outputs();
    void reply(std::uint32_t session, v1::ServerMessage message);
    void publish_state(v1::State state);
    void tell_state(v1::State state, v1::StateChanged change);
    void show_picture(Picture picture);
    v1::Stats stats();
    v1::Surfaces describe_surfaces() const { return surface_input_.describe(render_session_.scene()); }
    v1::Sources describe_sources() {
        v1::Sources sources = consoles_.sources();
        surface_input_.add_endpoints(sources);
        return sources;
    }
    FollowOptions follow_options(const std::string& boot) const;
    bool renew_gpu(const char* why, bool lost);
    bool begin_anew();
    bool pause() const;

    // In the order of their life: what stands further down ends first.
    const Options options_;
    const Tokens tokens_;
    const std::chrono::nanoseconds frame_time_{static_cast<std::int64_t>(1e9 / options_.target_fps)};
    Inbox inbox_;
    Shared<HttpServer> server_to_stop_;
    Shared<StateFile> show_to_save_;
    Shared<UploadStore> uploads_to_discard_;
    Reloading reloading_;
    Signals signals_{signal_actions()};                       // before all whose end takes time: it bounds that time
    const Forgotten forgotten_uploads_{uploads_to_discard_};  // the folder goes while signals still watch
    const std::optional<FileLock> show_lock_;
    Beginning first_;
    Gpu gpu_{gpu_maker(options_), first_.faults};
    const std::string renderer_name_ = name_renderer();
    const std::shared_ptr<UploadStore> uploads_ = open_uploads();  // ends after the HTTP server that writes them
    std::shared_ptr<HttpServer> http_server_;                      // ends after all that speaks to it
    FilePlace file_place_;
    LaneEncoders encoders_{encoder_setup(options_, first_.scene.width_px, first_.scene.height_px),
                           encoder_outputs(http_server_, waker(Queue<Work>::Wake::soon))};
    LaneFeed feed_{encoders_};
    const std::shared_ptr<Metrics> metrics_ = std::make_shared<Metrics>();
    RenderMetrics counted_{*metrics_};
    const Listening listening_{*this};
    Service service_;  // ends before the HTTP server that it asks
    const std::unique_ptr<Inputs> inputs_ = start_inputs();
    Consoles consoles_{inputs_.get(), frame_time_.count()};
    const std::unique_ptr<ControlSurfaces> surfaces_ = start_surfaces();
    SurfaceInput surface_input_{surfaces_.get(), frame_time_.count(), std::bind_front(&App::reply, this)};
    // Scenes that undo goes back to, as the disk had them at the start and read.
    Queue<std::pair<std::shared_ptr<const LeftScene>, std::shared_ptr<const LeftScene>>> lefts_{kMaxLoaderJobs};
    Loader loader_;
    const std::shared_ptr<StateFile> state_file_ = open_state_file();
    RenderSession render_session_{gpu_.take_renderer(), std::move(first_.scene), renderer_name_, inbox_.queue, loader_,
                                  session_outputs()};
    RenderLoop loop_{inbox_, render_session_, feed_, consoles_, surface_input_, frame_time_};
    std::unique_ptr<Follower> follower_;  // null: it follows nobody
};

}  // namespace gonio
