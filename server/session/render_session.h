// The render session: what runs on the render thread between the queue and the renderer. Owns the scene and the
// renderer, applies commands, answers queries, and says when a frame is due. No sockets and no encoder: it speaks
// through Outputs.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "server/base/queue.h"
#include "server/scene/preset.h"
#include "server/scene/strobe.h"
#include "server/session/auto_exposure.h"
#include "server/session/auto_range.h"
#include "server/session/budget.h"
#include "server/session/capture_queue.h"
#include "server/session/changes.h"
#include "server/session/followers.h"
#include "server/session/library.h"
#include "server/session/meter_queue.h"
#include "server/session/outlets.h"
#include "server/session/played_cues.h"
#include "server/session/reference_work.h"
#include "server/session/report_log.h"
#include "server/session/roles.h"
#include "server/session/scene_access.h"
#include "server/session/scene_files.h"
#include "server/session/undo.h"
#include "server/stream/encoder.h"

namespace gonio {

inline constexpr std::size_t kMaxPrepared = 512;      // profiles of a saved show's presets, 1 MiB and their web each
inline constexpr std::size_t kMaxFramesInFlight = 3;  // the readback ring

struct SessionOutputs {
    std::function<void(std::uint32_t session, v1::ServerMessage)> reply;
    std::function<void(v1::State, v1::StateChanged)> state;
    // What servers that follow this one may fetch; told before the answer that names it.
    std::function<void(std::shared_ptr<const Blobs>)> blobs = [](const auto&) {};
    std::function<void(Picture)> picture;    // a new picture left the GPU
    std::function<v1::Stats()> counters;     // what the stream side counts; settled: it has nothing left to say
    std::function<v1::Sources()> sources;    // the newest source table of the consoles
    std::function<v1::Surfaces()> surfaces;  // the fader boxes and what they drive
    // Answers the session when a control has moved; `gone` ends what the session waits for.
    std::function<void(std::uint32_t session, std::uint32_t request_id, double timeout_s)> learn;
    std::function<void(std::uint32_t session)> gone;
    // Whether the GPU is lost: what the renderer gives since is void.
    std::function<bool()> gpu_lost = [] { return false; };
};

class RenderSession {
public:
    RenderSession(std::unique_ptr<LiveRenderer> renderer, Scene scene, std::string renderer_name, Queue<Work>& queue,
                  Loader& loader, SessionOutputs outputs);

    // Takes one message: answers it, applies it, or sends it to the loader first.
    void take(Work work);
    // Applies what consoles say. Result: of each command why not, as gonio::apply_inputs(); "busy" where its files
    // cannot be read now, "held" for the camera while a client holds it. Clients are told of the changes after a
    // revision by tell_inputs(), once a frame. by: whose commands they are; 0: of a console or a fader box.
    std::vector<std::optional<Error>> apply_inputs(std::span<const v1::Command> commands, std::uint32_t by = 0,
                                                   Driven driven = Driven::by_hand);
    void tell_inputs(Revision before, std::uint32_t by = 0);
    // Brings a preset that is being faded, cues that run, strobes and the exposure to where they shall be now. Whether
    // it wants to be called with every frame:
    bool fading() const { return fade_.running() || cues_.fading() || auto_exposure_.gliding() || any_strobe(scene_); }
    // Result: ns until it wants to be called; INT64_MAX: never by itself.
    std::int64_t fade_in_ns(std::int64_t now_ns) const { return cues_.due_in_ns(scene_, now_ns); }
    void advance_fade(std::int64_t now_ns);
    // Time code that came at t_ns.
    void hear_timecode(TimecodeSource source, const Timecode& timecode, std::int64_t t_ns);
    // Whether the picture is older than the scene or not all there is to come of it; or somebody waits for a report.
    bool frame_wanted() const {
        return rendered_rev_ != scene_.scene_rev || flashed_ || better_ || !renderer_->settled() || owes();
    }
    bool report_wanted() const { return reports_.waited_for(); }
    // The GPU is lost: gives the renderer up, and the frames that it was at. With the next one captures and meter grids
    // begin anew, and a picture is due.
    void drop_renderer() { renderer_ = nullptr; }
    void set_renderer(std::unique_ptr<LiveRenderer> renderer);
    // Starts a frame of the scene as it stands now. With kMaxFramesInFlight on the GPU it first waits for the oldest.
    void begin_frame(std::int64_t drained_ns);
    // Publishes frames that have left the GPU; `wait` blocks for all of them.
    void finish_frames(bool wait);
    bool frames_in_flight() const { return renderer_->frames_in_flight() > 0; }
    // Which scene files clients may load.
    void set_scene_access(SceneAccess access) { scene_access_ = std::move(access); }
    // boot: names this run of the program; restored: the revision of the state file that it began with, 0: it had none.
    void set_boot(std::string boot, Revision restored) { boot_ = std::move(boot), restored_rev_ = restored; }
    // What a restart needs to go on with undo, goes on with it, and gets a scene of it that was read: as of Undo.
    std::shared_ptr<const UndoRecord> undo_record() const { return undo_.record(); }
    void go_on(const UndoRecord& record) { undo_.go_on(record, scene_); }
    void take_read(const std::shared_ptr<const LeftScene>& kept, std::shared_ptr<const LeftScene> read) {
        undo_.take_read(kept, std::move(read), scene_);
        tell_undo();
    }
    // Everything comes from the server of this address; no client, console, cue or automatic value changes anything.
    void set_leader(std::string address);
    // Whether the leader's revisions began again: the renderer is to be given up, and begin_anew() called when there is
    // another.
    bool begins_anew() const { return anew_ != nullptr; }
    void begin_anew();
    // Where profiles without photometry are sought; at first the built-in ones.
    void set_library(std::shared_ptr<Library> library) { library_ = std::move(library); }
    // Captures that are rendered one after the other; beyond it: "busy".
    void set_most_captures(std::size_t most) { captures_.set_most(most); }
    // Whether captures or meters go on at once.
    bool busy() const { return waits() && !wait_for_light_; }
    // Whether captures or meters wait, for what other threads make too.
    bool waits() const { return !captures_.empty() || !meters_.empty(); }
    // Between two frames: one tile of the oldest capture, a slice of the oldest meters; each is sent off when it is
    // complete. Reference jobs start and tell of their progress.
    void continue_work();
    // Frames that light anew keep within this time: smaller pictures of fewer VPLs while something moves, the whole one
    // when it rests.
    void set_budget(double frame_ms) { budget_ = Budget(frame_ms); }
    // Result: when rest brings something, ns from now: the whole picture that a small one stands for, or its
    // refinement; INT64_MAX: nothing.
    std::int64_t rest_in_ns() const;
    // While nobody looks, the picture is not refined, and what was asked for is all there is.
    void set_watched(bool watched);
    // Whether the picture can be refined: it shows the scene as it stands, and somebody looks.
    bool refinable() const { return watched_ && !frame_wanted() && budget_.chosen() == 0 && !refined_; }
    // Whether no picture will come until something changes.
    bool settled() const {
        return !frame_wanted() && !frames_in_flight() && !refinable() && !(watched_ && budget_.chosen() != 0);
    }
    // Whether the newest picture is the best there will be of the scene as it stands, looked at or not.
    bool complete() const { return !frame_wanted() && !frames_in_flight() && refined_ && budget_.chosen() == 0; }
    // Whether somebody sees a smaller picture than there is.
    bool owes() const { return watched_ && budget_.owes(monotonic_ns()); }
    // Whether it is time to: nothing changed for Budget::kRestNs.
    bool rests() const { return monotonic_ns() - changed_ns_ >= Budget::kRestNs; }
    // Does up to some 0.2 s of that, a few milliseconds if a message comes.
    void refine();
    const Scene& scene() const { return scene_; }
    // Result: all that clients know of the scene and of who holds the camera.
    v1::State state() const;

private:
    void note_picture(const std::string& failure);
    void await_assets();
    void prepare_presets();
    bool make_tables(std::shared_ptr<const Scene> scene, const Work& work);
    void tend_range();
    void begin_renderer();
    bool lights_anew() const;
    // Publishes the oldest frame of the renderer. Result: false where none is finished.
    bool take_frame(bool wait);
    // Each takes one kind of message.
    void cancel(const Work& work);
    void forget_session(std::uint32_t session);
    void change_holder(const Work& work);
    void take_command(Work work);
    void answer_meter(const Work& work);
    // request: of a meter, a grid or an observer.
    void measure(const Work& work, Result<MeterRequest> request);
    void answer_pick(const Work& work);
    void answer_beam(const Work& work);
    void answer_library(const Work& work);
    void answer_capture(const Work& work);
    void answer_report(const Work& work);
    void answer_profile(const Work& work);
    void answer_learn(const Work& work);
    void answer_lux_report(const Work& work);
    void take_save(Work work);
    void take_show_edit(Work work);
    void tell_show(std::uint32_t by);
    v1::Stats stats();
    // The live picture, where a denoised one of so few samples a pixel looks worse (ReferenceWork::Outputs::too_few).
    void capture_instead(const ReferenceJob& job, std::uint32_t samples);
    void submit_reference(const Work& work, std::variant<MeterRequest, CaptureRequest, LuxReportRequest> request);
    void take_leader(const std::shared_ptr<const LeaderNews>& news);
    void take_scene(const LeaderNews& news);
    void take_follow(const Work& work);
    bool follows() const { return !leader_.empty(); }
    Followers::Shown shown() const;
    v1::CuePlayback cue_playback() const;
    void tell_control(std::uint32_t by);
    void tell(v1::StateChanged change, std::uint32_t by);
    v1::ShowFile show_now() const;
    void put_scene_warnings(v1::StateChanged& change);
    void tell_change(const Scene& before, std::uint32_t by);
    void apply_command(const Work& work);
    void begin_scene();
    void list_profiles();
    void undo_or_redo(const Work& work);
    void run_cue(const Work& work);
    void note_cues(Revision before, std::uint32_t by);
    void begin_fade(const v1::Command& command, std::uint32_t by, std::uint64_t step);
    void tell_undo();
    bool send_to_loader(Work work);  // result: false where too much waits; then the client has been told

    SessionOutputs out_;
    GuardedRenderer renderer_;
    Scene scene_;
    std::string renderer_name_;
    Queue<Work>& queue_;
    Loader& loader_;
    Replies replies_;
    Roles roles_;
    Changes changes_;
    Revision rendered_rev_ = 0;
    bool flashed_ = false;  // a strobe went on or out since the last frame
    Budget budget_;
    std::int64_t changed_ns_ = INT64_MIN / 2;                  // when a frame of a new revision began
    bool wait_for_light_ = false;                              // captures and meters, for what other threads make
    bool watched_ = false, better_ = false, refined_ = false;  // better_: another frame shows more than the last
    Fade fade_;
    std::uint32_t fade_by_ = 0;    // whose recall it is
    std::uint64_t fade_step_ = 0;  // what it is in undo_; 0: of a console or a fader box
    PlayedCues cues_;
    std::uint32_t cue_by_ = 0;     // whose GO it was
    std::uint64_t cues_told_ = 0;  // how often clients have been told of cue_playback()
    Undo undo_;
    ReportLog reports_;
    CaptureQueue captures_;
    MeterQueue meters_;
    SceneAccess scene_access_;
    std::string boot_;
    Revision restored_rev_ = 0;
    std::string leader_;                      // address; empty: it follows nobody
    bool in_touch_ = true;                    // with the leader
    std::shared_ptr<const LeaderNews> anew_;  // that waits for another renderer
    v1::CuePlayback leader_cues_;             // cue_playback() of the leader
    ProfileTexts hashed_texts_;               // of show_hash()
    v1::ShowFile told_show_;
    std::shared_ptr<Library> library_ = std::make_shared<Library>();
    Followers followers_;
    ReferenceWork reference_;
    SceneFiles scene_files_;
    AutoExposure auto_exposure_;
    AutoRange auto_range_;
    std::uint32_t frames_rendered_ = 0, gpu_resets_ = 0;
    std::string picture_error_;  // why the newest picture is not as the scene is; empty: it is
    HiddenLights hidden_;
    std::vector<std::string> told_hidden_;  // what clients know of hidden_: among the warnings of the scene
};

}  // namespace gonio
