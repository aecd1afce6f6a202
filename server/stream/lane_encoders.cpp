#include "server/stream/lane_encoders.h"

#include <algorithm>
#include <thread>

#include "server/base/clock.h"
#include "server/stream/h264_stream.h"

namespace gonio {
namespace {

constexpr LaneId kJpegLane = 255;
constexpr int kJpegQualityPercent = 85;
constexpr std::size_t kMostTokens = 256;  // a lane has at most one
// The last kind that is left is opened anew, but not for ever: so many failures without as many good frames between.
constexpr unsigned kMostFailures = 3;
constexpr unsigned kGoodFrames = 100;

// Whether a P frame says no more than that nothing changed: skipped macroblocks cost next to nothing.
bool is_sharp(const EncodedFrame& frame, const Picture& picture) {
    const std::size_t macroblocks =
        static_cast<std::size_t>(picture.width_px) * static_cast<std::size_t>(picture.height_px) / 256;
    return !frame.key && frame.data.size() <= std::max<std::size_t>(256, macroblocks / 8);
}

}  // namespace

// Who may touch the state of a lane is said by its phase: the thread that runs it owns the encoder, the owner of all
// may replace a state that it has declared abandoned. Only one of "the thread publishes" and "the owner abandons"
// happens.
struct LaneEncoders::LaneState {
    enum class Phase : std::uint8_t { idle, waiting, running, publishing, abandoned };
    explicit LaneState(LaneId id) : lane(id) {}

    const LaneId lane;
    Latest<LaneJob> jobs;
    std::atomic<Phase> phase{Phase::idle};
    std::atomic<std::int64_t> began_ns{0};
    std::atomic<std::size_t> thread{0};  // that runs it
    std::atomic<bool> key_owed{false};   // the next frame must be an IDR
    std::atomic<bool> close{false};      // the encoder is to be closed
    // Of what was published.
    std::atomic<std::uint32_t> frames{0}, keys{0};
    std::atomic<bool> sharp{false}, final{false};
    std::atomic<std::size_t> kind{0};  // index into Setup::kinds of the encoder
    // Of the thread that runs it.
    std::unique_ptr<H264Encoder> encoder;
    int width_px = 0, height_px = 0;
    unsigned failures = 0, good = 0;
};

// What threads keep alive, abandoned ones too.
struct LaneEncoders::Shared {
    Shared(Setup s, Outputs o) : setup(std::move(s)), out(std::move(o)) {}
    const Setup setup;
    const Outputs out;
    Queue<std::shared_ptr<LaneState>> tokens{kMostTokens};
    Queue<std::size_t> ended{kMostTokens};
    std::atomic<bool> given_up{false};
    std::atomic<std::uint32_t> frames_encoded{0};
    std::atomic<std::uint64_t> given{0}, done{0};  // Turns

    // False once the owner has abandoned the state: then nobody may hear of its results.
    static bool publishes(LaneState& state) {
        auto running = LaneState::Phase::running;
        return state.phase.compare_exchange_strong(running, LaneState::Phase::publishing);
    }
    void give_to_thread(const std::shared_ptr<LaneState>& state) {
        auto idle = LaneState::Phase::idle;
        if (!state->phase.compare_exchange_strong(idle, LaneState::Phase::waiting)) return;
        ++given;
        tokens.push(state);
    }
    void give_up() {
        if (!given_up.exchange(true)) out.given_up();
    }
    // Result: false where no kind can be opened.
    bool open_encoder(LaneState& state, const Picture& picture, std::vector<std::string>& trouble) {
        state.encoder.reset();
        for (; state.kind < setup.kinds.size(); ++state.kind) {
            const std::string& kind = setup.kinds[state.kind];
            auto opened = setup.open(kind, picture.width_px, picture.height_px);
            if (opened) {
                state.encoder = std::move(*opened);
                state.width_px = picture.width_px;
                state.height_px = picture.height_px;
                return true;
            }
            trouble.push_back("lane " + std::to_string(state.lane) + ": " + opened.error().text());
        }
        return false;
    }
    // After a failure: the next kind; of the last one a new encoder, some times. Result: false where nothing is left.
    bool next_encoder(LaneState& state) {
        state.encoder.reset();
        if (state.kind + 1 < setup.kinds.size()) {
            ++state.kind;
            state.failures = 0;
            return true;
        }
        return ++state.failures < kMostFailures;
    }
    // Result: the frame; an error where no kind of encoder makes it. fresh: an encoder was opened for it.
    Result<EncodedFrame> encode(LaneState& state, const LaneJob& job, bool& fresh, std::vector<std::string>& trouble) {
        FrameRequest request = job.request;
        request.key = state.key_owed.exchange(false) || request.key;
        for (;;) {
            if (!state.encoder || job.picture.width_px != state.width_px || job.picture.height_px != state.height_px) {
                if (!open_encoder(state, job.picture, trouble))
                    return Error{"encoder_unavailable", "", "", "No H.264 encoder can be opened."};
                request.key = fresh = true;
            }
            auto frame = state.encoder->encode(job.picture, request);
            if (frame && frame->key) frame = checked(std::move(*frame), job.picture);
            if (frame) {
                if (++state.good >= kGoodFrames) state.failures = 0;
                return frame;
            }
            state.good = 0;
            trouble.push_back("lane " + std::to_string(state.lane) + ": " + frame.error().text());
            if (!next_encoder(state)) return frame.error();
        }
    }
    // A key frame says the size of its pictures: some hardware pads what it cannot crop.
    static Result<EncodedFrame> checked(EncodedFrame frame, const Picture& picture) {
        const auto info = read_stream_info(frame.data);
        if (info &&
            (info->width_px == 0 || (info->width_px == picture.width_px && info->height_px == picture.height_px)))
            return frame;
        const std::string size =
            info ? std::to_string(info->width_px) + "x" + std::to_string(info->height_px) : "no SPS";
        return Error{"encoder_failed", "", size, "The encoder made a stream of another size."};
    }

    void run_h264(LaneState& state, const LaneJob& job) {
        bool fresh = false;
        std::vector<std::string> trouble;
        auto frame = encode(state, job, fresh, trouble);
        if (!publishes(state)) return;
        for (const std::string& line : trouble) out.trouble(line);
        if (!frame) return give_up();
        if (fresh)
            out.stream(state.lane,
                       {state.encoder->codec_string(), setup.kinds[state.kind], state.width_px, state.height_px});
        frame->lane = state.lane;
        const bool sharp = job.fine && is_sharp(*frame, job.picture), final = job.settled && (sharp || job.last);
        state.sharp = sharp;
        state.final = final;
        if (frame->key) ++state.keys;
        ++state.frames;
        ++frames_encoded;
        out.h264(std::move(*frame), final);
    }
    void run_jpeg(LaneState& state, const LaneJob& job) {
        auto frame = encode_jpeg_frame(job.picture, kJpegQualityPercent);
        if (!publishes(state)) return;
        if (!frame) return out.trouble(frame.error().text());
        ++state.frames;
        ++frames_encoded;
        out.jpeg(std::move(*frame));
    }
    // Result: false where the state was abandoned, and its thread with it.
    bool run(const std::shared_ptr<LaneState>& state, std::size_t thread) {
        state->thread = thread;
        state->began_ns = monotonic_ns();
        auto waiting = LaneState::Phase::waiting;
        state->phase.compare_exchange_strong(waiting, LaneState::Phase::running);
        const auto job = state->jobs.try_take();
        if (state->close.exchange(false)) {
            state->encoder.reset();
            state->kind = state->failures = 0;
        }
        if (job && state->lane == kJpegLane)
            run_jpeg(*state, *job);
        else if (job && !given_up.load())
            run_h264(*state, *job);
        if (state->phase.load() == LaneState::Phase::running) publishes(*state);
        if (state->phase.load() == LaneState::Phase::abandoned) return false;
        state->phase = LaneState::Phase::idle;
        ++done;
        if (state->jobs.waiting()) give_to_thread(state);  // one that came while the last was in work
        out.idle();
        return true;
    }
};

LaneEncoders::LaneEncoders(Setup setup, Outputs outputs)
    : shared_(std::make_shared<Shared>(std::move(setup), std::move(outputs))) {
    shared_->given_up = shared_->setup.kinds.empty();  // from the start: nobody need be told
    threads_.resize(std::max(1u, shared_->setup.threads));
    for (std::size_t i = 0; i < threads_.size(); ++i) start_thread(i);
}

LaneEncoders::~LaneEncoders() {
    shared_->tokens.close();
    const auto deadline = std::chrono::steady_clock::now() + shared_->setup.stuck;
    std::vector<bool> ended(threads_.size());
    for (std::size_t count = 0; count < threads_.size(); ++count) {
        const auto left = deadline - std::chrono::steady_clock::now();
        const auto index = shared_->ended.pop_for(std::max(left, decltype(left)::zero()));
        if (!index) break;
        ended[*index] = true;
    }
    for (const auto& [lane, state] : states_) {
        auto running = LaneState::Phase::running;
        if (!ended[state->thread] && state->phase.compare_exchange_strong(running, LaneState::Phase::abandoned))
            threads_[state->thread].detach();
    }
    for (std::thread& thread : threads_)
        if (thread.joinable()) thread.join();
}

void LaneEncoders::start_thread(std::size_t index) {
    threads_[index] = std::thread([shared = shared_, index] {
        while (auto state = shared->tokens.pop())
            if (!shared->run(*state, index)) return;
        shared->ended.push(index);
    });
}

const LaneEncoders::LaneState* LaneEncoders::find(LaneId lane) const {
    const auto found = states_.find(lane);
    return found == states_.end() ? nullptr : found->second.get();
}

bool LaneEncoders::begins_soon(LaneId lane) const {
    const LaneState* found = find(lane);
    const auto phase = found ? found->phase.load() : LaneState::Phase::idle;
    return phase == LaneState::Phase::idle || phase == LaneState::Phase::waiting;
}

bool LaneEncoders::takes(LaneId lane) const {
    return works() && begins_soon(lane);
}

bool LaneEncoders::idle(LaneId lane) const {
    const LaneState* found = find(lane);
    return !found || (found->phase.load() == LaneState::Phase::idle && !found->jobs.waiting());
}

void LaneEncoders::put(LaneId lane, LaneJob job) {
    auto& state = states_[lane];
    if (!state) state = std::make_shared<LaneState>(lane);
    if (job.request.key) state->key_owed = true;  // also where a newer picture replaces this one
    state->jobs.put(std::move(job));
    shared_->give_to_thread(state);
}

bool LaneEncoders::takes_jpeg() const {
    return begins_soon(kJpegLane);
}

void LaneEncoders::put_jpeg(Picture picture) {
    put(kJpegLane, {.picture = std::move(picture)});
}

void LaneEncoders::close(LaneId lane) {
    const auto found = states_.find(lane);
    if (found == states_.end()) return;
    found->second->close = true;
    shared_->give_to_thread(found->second);
}

std::vector<LaneId> LaneEncoders::check() {
    std::vector<LaneId> lost;
    for (auto& [lane, stuck] : states_) {
        if (stuck->phase.load() != LaneState::Phase::running) continue;
        if (monotonic_ns() - stuck->began_ns.load() < std::chrono::nanoseconds(shared_->setup.stuck).count()) continue;
        auto running = LaneState::Phase::running;
        if (!stuck->phase.compare_exchange_strong(running, LaneState::Phase::abandoned)) continue;
        const std::size_t thread = stuck->thread;
        auto fresh = std::make_shared<LaneState>(lane);
        fresh->frames = stuck->frames.load();
        fresh->keys = stuck->keys.load();
        fresh->kind = std::min(stuck->kind + 1, std::max<std::size_t>(shared_->setup.kinds.size(), 1) - 1);
        fresh->key_owed = true;
        stuck = fresh;
        lost.push_back(lane);
        ++shared_->done;
        threads_[thread].detach();
        start_thread(thread);
        shared_->out.trouble("lane " + std::to_string(lane) + ": the encoder does not answer; it is left behind");
        if (++stuck_ > shared_->setup.most_stuck) shared_->give_up();
    }
    return lost;
}

void LaneEncoders::encode_first(LaneId lane, const Picture& picture) {
    while (frames_encoded() == 0) {
        if (works() && idle(lane)) put(lane, {.picture = picture, .request = {.key = true}});
        if (!works() && idle(kJpegLane)) put_jpeg(picture);
        check();
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
}

LaneEncoders::Counts LaneEncoders::counts(LaneId lane) const {
    const LaneState* found = find(lane);
    if (!found) return {};
    const std::size_t kind = found->kind.load();
    const auto& kinds = shared_->setup.kinds;
    return {found->frames.load(), found->keys.load(), found->sharp.load(), found->final.load(),
            kind < kinds.size() ? kinds[kind].c_str() : ""};
}

bool LaneEncoders::works() const {
    return !shared_->given_up.load();
}

std::string LaneEncoders::encoder() const {
    return works() ? shared_->setup.kinds.front() : "mjpeg";
}

std::uint32_t LaneEncoders::jpeg_frames() const {
    return counts(kJpegLane).frames;
}

std::uint32_t LaneEncoders::frames_encoded() const {
    return shared_->frames_encoded.load();
}

LaneEncoders::Turns LaneEncoders::turns() const {
    const std::uint64_t given = shared_->given.load();  // first: what is given meanwhile may be done already
    return {given, shared_->done.load()};
}

}  // namespace gonio
