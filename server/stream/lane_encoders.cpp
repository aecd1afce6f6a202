#include "server/stream/lane_encoders.h"

#include <algorithm>
#include <thread>

#include "server/base/clock.h"
#include "server/stream/h264_stream.h"

namespace gonio {
namespace {

constexpr LaneId kJpegLane = 255;
constexpr int kJpegQualityPercent = 85;
constexpr std::size_t kMostTokens = 256;  // a slot has at most one
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

// Who may touch a slot is said by its phase: the thread that runs it owns the encoder, the owner of all may replace a
// slot that it has declared abandoned. Only one of "the thread publishes" and "the owner abandons" happens.
struct LaneEncoders::Slot {
    enum class Phase : std::uint8_t { idle, waiting, running, publishing, abandoned };
    explicit Slot(LaneId id) : lane(id) {}

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
    Queue<std::shared_ptr<Slot>> tokens{kMostTokens};
    Queue<std::size_t> ended{kMostTokens};
    std::atomic<bool> given_up{false};
    std::atomic<std::uint32_t> frames_encoded{0};

    // False once the owner has abandoned the slot: then nobody may hear of its results.
    static bool publishes(Slot& slot) {
        auto running = Slot::Phase::running;
        return slot.phase.compare_exchange_strong(running, Slot::Phase::publishing);
    }
    void give_to_thread(const std::shared_ptr<Slot>& slot) {
        auto idle = Slot::Phase::idle;
        if (slot->phase.compare_exchange_strong(idle, Slot::Phase::waiting)) tokens.push(slot);
    }
    void give_up() {
        if (!given_up.exchange(true)) out.given_up();
    }
    // Result: false where no kind can be opened.
    bool open_encoder(Slot& slot, const Picture& picture, std::vector<std::string>& trouble) {
        slot.encoder.reset();
        for (; slot.kind < setup.kinds.size(); ++slot.kind) {
            const std::string& kind = setup.kinds[slot.kind];
            auto opened = setup.open(kind, picture.width_px, picture.height_px);
            if (opened) {
                slot.encoder = std::move(*opened);
                slot.width_px = picture.width_px;
                slot.height_px = picture.height_px;
                return true;
            }
            trouble.push_back("lane " + std::to_string(slot.lane) + ": " + opened.error().text());
        }
        return false;
    }
    // After a failure: the next kind; of the last one a new encoder, some times. Result: false where nothing is left.
    bool next_encoder(Slot& slot) {
        slot.encoder.reset();
        if (slot.kind + 1 < setup.kinds.size()) {
            ++slot.kind;
            slot.failures = 0;
            return true;
        }
        return ++slot.failures < kMostFailures;
    }
    // Result: the frame; an error where no kind of encoder makes it. fresh: an encoder was opened for it.
    Result<EncodedFrame> encode(Slot& slot, const LaneJob& job, bool& fresh, std::vector<std::string>& trouble) {
        FrameRequest request = job.request;
        request.key = slot.key_owed.exchange(false) || request.key;
        for (;;) {
            if (!slot.encoder || job.picture.width_px != slot.width_px || job.picture.height_px != slot.height_px) {
                if (!open_encoder(slot, job.picture, trouble))
                    return Error{"encoder_unavailable", "", "", "No H.264 encoder can be opened."};
                request.key = fresh = true;
            }
            auto frame = slot.encoder->encode(job.picture, request);
            if (frame && frame->key) frame = checked(std::move(*frame), job.picture);
            if (frame) {
                if (++slot.good >= kGoodFrames) slot.failures = 0;
                return frame;
            }
            slot.good = 0;
            trouble.push_back("lane " + std::to_string(slot.lane) + ": " + frame.error().text());
            if (!next_encoder(slot)) return frame.error();
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

    void run_h264(Slot& slot, const LaneJob& job) {
        bool fresh = false;
        std::vector<std::string> trouble;
        auto frame = encode(slot, job, fresh, trouble);
        if (!publishes(slot)) return;
        for (const std::string& line : trouble) out.trouble(line);
        if (!frame) return give_up();
        if (fresh)
            out.stream(slot.lane,
                       {slot.encoder->codec_string(), setup.kinds[slot.kind], slot.width_px, slot.height_px});
        frame->lane = slot.lane;
        const bool sharp = is_sharp(*frame, job.picture), final = job.settled && (sharp || job.last);
        slot.sharp = sharp;
        slot.final = final;
        if (frame->key) ++slot.keys;
        ++slot.frames;
        ++frames_encoded;
        out.h264(std::move(*frame), final);
    }
    void run_jpeg(Slot& slot, const LaneJob& job) {
        auto frame = encode_jpeg_frame(job.picture, kJpegQualityPercent);
        if (!publishes(slot)) return;
        if (!frame) return out.trouble(frame.error().text());
        ++slot.frames;
        ++frames_encoded;
        out.jpeg(std::move(*frame));
    }
    // Result: false where the slot was abandoned, and its thread with it.
    bool run(const std::shared_ptr<Slot>& slot, std::size_t thread) {
        slot->thread = thread;
        slot->began_ns = monotonic_ns();
        auto waiting = Slot::Phase::waiting;
        slot->phase.compare_exchange_strong(waiting, Slot::Phase::running);
        const auto job = slot->jobs.try_take();
        if (slot->close.exchange(false)) {
            slot->encoder.reset();
            slot->kind = slot->failures = 0;
        }
        if (job && slot->lane == kJpegLane)
            run_jpeg(*slot, *job);
        else if (job && !given_up.load())
            run_h264(*slot, *job);
        if (slot->phase.load() == Slot::Phase::running) publishes(*slot);
        if (slot->phase.load() == Slot::Phase::abandoned) return false;
        slot->phase = Slot::Phase::idle;
        if (slot->jobs.waiting()) give_to_thread(slot);  // one that came while the last was in work
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
    for (const auto& [lane, slot] : slots_) {
        auto running = Slot::Phase::running;
        if (!ended[slot->thread] && slot->phase.compare_exchange_strong(running, Slot::Phase::abandoned))
            threads_[slot->thread].detach();
    }
    for (std::thread& thread : threads_)
        if (thread.joinable()) thread.join();
}

void LaneEncoders::start_thread(std::size_t index) {
    threads_[index] = std::thread([shared = shared_, index] {
        while (auto slot = shared->tokens.pop())
            if (!shared->run(*slot, index)) return;
        shared->ended.push(index);
    });
}

const LaneEncoders::Slot* LaneEncoders::find(LaneId lane) const {
    const auto found = slots_.find(lane);
    return found == slots_.end() ? nullptr : found->second.get();
}

bool LaneEncoders::begins_soon(LaneId lane) const {
    const Slot* found = find(lane);
    const auto phase = found ? found->phase.load() : Slot::Phase::idle;
    return phase == Slot::Phase::idle || phase == Slot::Phase::waiting;
}

bool LaneEncoders::takes(LaneId lane) const {
    return works() && begins_soon(lane);
}

bool LaneEncoders::idle(LaneId lane) const {
    const Slot* found = find(lane);
    return !found || (found->phase.load() == Slot::Phase::idle && !found->jobs.waiting());
}

void LaneEncoders::put(LaneId lane, LaneJob job) {
    auto& slot = slots_[lane];
    if (!slot) slot = std::make_shared<Slot>(lane);
    if (job.request.key) slot->key_owed = true;  // also where a newer picture replaces this one
    slot->jobs.put(std::move(job));
    shared_->give_to_thread(slot);
}

bool LaneEncoders::takes_jpeg() const {
    return begins_soon(kJpegLane);
}

void LaneEncoders::put_jpeg(Picture picture) {
    put(kJpegLane, {.picture = std::move(picture)});
}

void LaneEncoders::close(LaneId lane) {
    const auto found = slots_.find(lane);
    if (found == slots_.end()) return;
    found->second->close = true;
    shared_->give_to_thread(found->second);
}

std::vector<LaneId> LaneEncoders::check() {
    std::vector<LaneId> lost;
    for (auto& [lane, stuck] : slots_) {
        if (stuck->phase.load() != Slot::Phase::running) continue;
        if (monotonic_ns() - stuck->began_ns.load() < std::chrono::nanoseconds(shared_->setup.stuck).count()) continue;
        auto running = Slot::Phase::running;
        if (!stuck->phase.compare_exchange_strong(running, Slot::Phase::abandoned)) continue;
        const std::size_t thread = stuck->thread;
        auto fresh = std::make_shared<Slot>(lane);
        fresh->frames = stuck->frames.load();
        fresh->keys = stuck->keys.load();
        fresh->kind = std::min(stuck->kind + 1, std::max<std::size_t>(shared_->setup.kinds.size(), 1) - 1);
        fresh->key_owed = true;
        stuck = fresh;
        lost.push_back(lane);
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
    const Slot* found = find(lane);
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

}  // namespace gonio
