// Encoders that fail, hang or lie, put in by the tests: viewers go on with an IDR of the next encoder, nobody waits.
#include "server/stream/lane_encoders.h"

#include <gtest/gtest.h>

#include <condition_variable>
#include <cstring>
#include <map>
#include <mutex>
#include <set>
#include <thread>

#include "server/stream/lane_feed.h"

namespace gonio {
namespace {

using namespace std::chrono_literals;

constexpr LaneId kLane = kFirstPrivateLane;

Picture grey_picture(int width, int height, std::uint32_t rev, std::uint8_t luma = 100) {
    Picture picture;
    picture.scene_rev = rev;
    picture.width_px = width;
    picture.height_px = height;
    picture.nv12 =
        std::make_shared<const std::vector<std::uint8_t>>(static_cast<std::size_t>(width * height * 3 / 2), luma);
    return picture;
}

// How the encoders of one kind behave.
struct Fault {
    bool opens = true;
    int fails_at = -1;              // the frame of an encoder's life that fails
    int hangs_at = -1;              // that never returns, until the test ends
    int wrong_size_at = -1;         // a key frame of another size
    unsigned opens_at_most = 1000;  // as drivers limit their sessions
};

// A factory of libx264 encoders with faults, and a record of what came out.
struct Bench {
    std::map<std::string, Fault> faults;
    std::mutex mutex;
    std::condition_variable changed;
    std::map<std::string, unsigned> opened;
    bool released = false;  // those that hang go on
    int hanging = 0;
    struct Out {
        LaneId lane;
        bool key, final;
        std::uint32_t rev;
        std::string encoder;  // of the stream it belongs to
        std::size_t bytes;
    };
    std::vector<Out> frames;
    std::map<LaneId, VideoStream> streams;
    std::vector<std::string> log;  // "stream NAME", "frame", "key", in order
    int given_up = 0, jpegs = 0;

    class Faulty final : public H264Encoder {
    public:
        Faulty(Bench& bench, Fault fault, std::unique_ptr<H264Encoder> inner, std::unique_ptr<H264Encoder> other)
            : bench_(bench), fault_(fault), inner_(std::move(inner)), other_(std::move(other)) {}
        Result<EncodedFrame> encode(const Picture& picture, const FrameRequest& request) override {
            const int frame = frame_++;
            if (frame == fault_.fails_at) return Error{"encoder_failed", "", "", "injected"};
            if (frame == fault_.wrong_size_at) {
                auto lie = other_->encode(grey_picture(64, 64, picture.scene_rev), FrameRequest{true, 0, kCrf});
                return lie;
            }
            if (frame == fault_.hangs_at) {
                std::unique_lock lock(bench_.mutex);
                ++bench_.hanging;
                bench_.changed.notify_all();
                bench_.changed.wait(lock, [&] { return bench_.released; });
                --bench_.hanging;
                bench_.changed.notify_all();
            }
            return inner_->encode(picture, request);
        }
        std::string codec_string() const override { return inner_->codec_string(); }

    private:
        Bench& bench_;
        Fault fault_;
        std::unique_ptr<H264Encoder> inner_, other_;
        int frame_ = 0;
    };

    LaneEncoders::Setup setup(std::vector<std::string> kinds) {
        LaneEncoders::Setup result;
        result.kinds = std::move(kinds);
        result.stuck = 150ms;
        result.open = [this](const std::string& kind, int width, int height) -> Result<std::unique_ptr<H264Encoder>> {
            Fault fault;
            {
                std::lock_guard lock(mutex);
                fault = faults[kind];
                if (!fault.opens || opened[kind] >= fault.opens_at_most)
                    return Error{"encoder_unavailable", kind, "", "injected"};
                ++opened[kind];
            }
            auto inner = H264Encoder::open(width, height), other = H264Encoder::open(64, 64);
            if (!inner || !other) return inner.error();
            return std::unique_ptr<H264Encoder>(
                std::make_unique<Faulty>(*this, fault, std::move(*inner), std::move(*other)));
        };
        return result;
    }
    LaneEncoders::Outputs outputs() {
        LaneEncoders::Outputs out;
        out.stream = [this](LaneId lane, const VideoStream& stream) {
            std::lock_guard lock(mutex);
            streams[lane] = stream;
            log.push_back("stream " + stream.encoder);
        };
        out.h264 = [this](EncodedFrame frame, bool final) {
            std::lock_guard lock(mutex);
            frames.push_back(
                {frame.lane, frame.key, final, frame.scene_rev, streams[frame.lane].encoder, frame.data.size()});
            log.emplace_back(frame.key ? "key" : "frame");
            changed.notify_all();
        };
        out.jpeg = [this](EncodedFrame) {
            std::lock_guard lock(mutex);
            ++jpegs;
            changed.notify_all();
        };
        out.idle = [] {};
        out.given_up = [this] {
            std::lock_guard lock(mutex);
            ++given_up;
            changed.notify_all();
        };
        out.trouble = [](const std::string&) {};
        return out;
    }
    void release() {
        std::unique_lock lock(mutex);
        released = true;
        changed.notify_all();
        changed.wait_for(lock, 2s, [&] { return hanging == 0; });
    }
    std::size_t count() {
        std::lock_guard lock(mutex);
        return frames.size();
    }
};

// Gives the lane pictures until `enough`, as the render thread would.
template <typename Enough>
bool feed_until(LaneEncoders& encoders, LaneId lane, Bench& bench, const Enough& enough, int width = 96,
                int height = 64, std::chrono::milliseconds patience = 5s) {
    const auto end = std::chrono::steady_clock::now() + patience;
    for (std::uint32_t rev = 1; std::chrono::steady_clock::now() < end; ++rev) {
        {
            std::lock_guard lock(bench.mutex);
            if (enough()) return true;
        }
        encoders.check();
        if (encoders.takes(lane)) {
            LaneJob job;
            job.picture = grey_picture(width, height, rev, static_cast<std::uint8_t>(40 + rev % 100));
            encoders.put(lane, std::move(job));
        }
        std::this_thread::sleep_for(1ms);
    }
    return false;
}

TEST(LaneEncoders, AKindThatCannotBeOpenedIsPassedOver) {
    Bench bench;
    bench.faults["h264_nvenc"].opens = false;
    LaneEncoders encoders(bench.setup({"h264_nvenc", "libx264"}), bench.outputs());
    ASSERT_TRUE(feed_until(encoders, kLane, bench, [&] { return bench.frames.size() >= 3; }));
    EXPECT_EQ(bench.frames[0].encoder, "libx264");
    EXPECT_TRUE(bench.frames[0].key);
    EXPECT_EQ(bench.streams[kLane].width_px, 96);
    EXPECT_EQ(bench.log[0], "stream libx264") << "the stream is told before its first frame";
    EXPECT_STREQ(encoders.counts(kLane).encoder, "libx264");
}

// Drivers limit how many sessions a system has.
TEST(LaneEncoders, OneSessionThenTheNextKind) {
    Bench bench;
    bench.faults["h264_nvenc"].opens_at_most = 1;
    LaneEncoders encoders(bench.setup({"h264_nvenc", "libx264"}), bench.outputs());
    ASSERT_TRUE(feed_until(encoders, kLane, bench, [&] { return bench.streams.contains(kLane); }));
    ASSERT_TRUE(feed_until(encoders, kSharedLane, bench, [&] { return bench.streams.contains(kSharedLane); }));
    EXPECT_EQ(bench.streams[kLane].encoder, "h264_nvenc");
    EXPECT_EQ(bench.streams[kSharedLane].encoder, "libx264");
}

TEST(LaneEncoders, AFailureAtAnyFrameGoesOnWithAnIdrOfTheNextKind) {
    for (const int at : {0, 1, 7}) {
        Bench bench;
        bench.faults["h264_nvenc"].fails_at = at;
        LaneEncoders encoders(bench.setup({"h264_nvenc", "libx264"}), bench.outputs());
        const auto frames = static_cast<std::size_t>(at + 5);
        ASSERT_TRUE(feed_until(encoders, kLane, bench, [&] { return bench.frames.size() >= frames; })) << at;
        const std::lock_guard lock(bench.mutex);
        for (std::size_t i = 0; i < frames; ++i) {
            const bool after = static_cast<int>(i) >= at;
            EXPECT_EQ(bench.frames[i].encoder, after ? "libx264" : "h264_nvenc") << at << " " << i;
            EXPECT_EQ(bench.frames[i].key, i == 0 || static_cast<int>(i) == at) << at << " " << i;
            if (i > 0) {
                EXPECT_GT(bench.frames[i].rev, bench.frames[i - 1].rev);
            }
        }
        EXPECT_EQ(bench.given_up, 0);
    }
}

TEST(LaneEncoders, TheLastKindIsOpenedAnewButNotForEver) {
    Bench bench;
    bench.faults["libx264"].fails_at = 3;  // each one that is opened
    LaneEncoders encoders(bench.setup({"libx264"}), bench.outputs());
    ASSERT_TRUE(feed_until(encoders, kLane, bench, [&] { return bench.given_up > 0; }));
    EXPECT_EQ(bench.given_up, 1);
    EXPECT_EQ(bench.opened["libx264"], 3u);
    EXPECT_EQ(bench.frames.size(), 9u);
    EXPECT_EQ(encoders.encoder(), "mjpeg");
    EXPECT_FALSE(encoders.takes(kLane));
    // MJPEG goes on.
    encoders.put_jpeg(grey_picture(96, 64, 1));
    std::unique_lock lock(bench.mutex);
    EXPECT_TRUE(bench.changed.wait_for(lock, 2s, [&] { return bench.jpegs == 1; }));
}

TEST(LaneEncoders, AStreamOfAnotherSizeIsAFailure) {
    Bench bench;
    bench.faults["h264_vaapi"].wrong_size_at = 0;
    LaneEncoders encoders(bench.setup({"h264_vaapi", "libx264"}), bench.outputs());
    ASSERT_TRUE(feed_until(encoders, kLane, bench, [&] { return bench.frames.size() >= 2; }));
    EXPECT_EQ(bench.frames[0].encoder, "libx264");
    EXPECT_TRUE(bench.frames[0].key);
}

TEST(LaneEncoders, ANewSizeIsANewStream) {
    Bench bench;
    LaneEncoders encoders(bench.setup({"libx264"}), bench.outputs());
    ASSERT_TRUE(feed_until(encoders, kLane, bench, [&] { return bench.frames.size() >= 2; }));
    ASSERT_TRUE(feed_until(
        encoders, kLane, bench,
        [&] { return bench.streams[kLane].width_px == 128 && bench.log.back() != "stream libx264"; }, 128, 96));
    const std::lock_guard lock(bench.mutex);
    const auto second = std::find(bench.log.begin() + 1, bench.log.end(), "stream libx264");
    ASSERT_NE(second, bench.log.end());
    ASSERT_NE(second + 1, bench.log.end());
    EXPECT_EQ(*(second + 1), "key");
}

TEST(LaneEncoders, OneThatHangsIsLeftBehindWithItsThread) {
    Bench bench;
    bench.faults["h264_nvenc"].hangs_at = 2;
    auto setup = bench.setup({"h264_nvenc", "libx264"});
    setup.threads = 1;  // the hanging one: without another thread nothing would go on
    {
        LaneEncoders encoders(std::move(setup), bench.outputs());
        const auto slowest = [&] {
            // Neither put nor check waits for the encoder that hangs.
            auto longest = 0ns;
            const auto end = std::chrono::steady_clock::now() + 5s;
            while (std::chrono::steady_clock::now() < end && bench.count() < 8) {
                const auto begin = std::chrono::steady_clock::now();
                encoders.check();
                if (encoders.takes(kLane)) encoders.put(kLane, {grey_picture(96, 64, 1), {}, false, false});
                longest = std::max<std::chrono::nanoseconds>(longest, std::chrono::steady_clock::now() - begin);
                std::this_thread::sleep_for(1ms);
            }
            return longest;
        }();
        EXPECT_LT(slowest, 100ms);
        const auto end = std::chrono::steady_clock::now() + 5s;
        while (encoders.turns().done < encoders.turns().given && std::chrono::steady_clock::now() < end)
            std::this_thread::sleep_for(1ms);
        EXPECT_EQ(encoders.turns().done, encoders.turns().given) << "the one left behind counts as done";
        const std::lock_guard lock(bench.mutex);
        ASSERT_GE(bench.frames.size(), 8u);
        EXPECT_EQ(bench.frames[1].encoder, "h264_nvenc");
        EXPECT_EQ(bench.frames[2].encoder, "libx264");
        EXPECT_TRUE(bench.frames[2].key);
        EXPECT_EQ(bench.given_up, 0);
        EXPECT_EQ(bench.hanging, 1);
    }
    const std::size_t before = bench.count();
    bench.release();  // it comes back after its time: nobody hears of it
    std::this_thread::sleep_for(20ms);
    EXPECT_EQ(bench.count(), before);
}

TEST(LaneEncoders, AfterSomeThatHangH264IsGivenUp) {
    Bench bench;
    bench.faults["libx264"].hangs_at = 1;
    auto setup = bench.setup({"libx264"});
    setup.most_stuck = 2;
    setup.stuck = 400ms;
    {
        LaneEncoders encoders(std::move(setup), bench.outputs());
        ASSERT_TRUE(feed_until(encoders, kLane, bench, [&] { return bench.given_up > 0; }));
        const std::lock_guard lock(bench.mutex);
        EXPECT_EQ(bench.hanging, 3);
        EXPECT_EQ(bench.frames.size(), 3u);
    }
    bench.release();
}

TEST(LaneEncoders, EndsThoughAnEncoderHangs) {
    Bench bench;
    bench.faults["libx264"].hangs_at = 0;
    const auto begin = std::chrono::steady_clock::now();
    {
        LaneEncoders encoders(bench.setup({"libx264"}), bench.outputs());
        encoders.put(kLane, {grey_picture(96, 64, 1), {}, false, false});
        std::unique_lock lock(bench.mutex);
        ASSERT_TRUE(bench.changed.wait_for(lock, 2s, [&] { return bench.hanging == 1; }));
        EXPECT_EQ(encoders.turns().given, 1u);
        EXPECT_EQ(encoders.turns().done, 0u);
    }
    EXPECT_LT(std::chrono::steady_clock::now() - begin, 2s);
    bench.release();
}

TEST(WorkingEncoders, EachIsTriedWithAFrame) {
    std::vector<std::string> notes;
    const auto note = [&](const std::string& line) { notes.push_back(line); };
    const EncoderFactory open = [](const std::string& kind, int width, int height) {
        return H264Encoder::open(width, height, kind);
    };
    const auto working = working_encoders("auto", 320, 240, open, note);
    EXPECT_NE(std::find(working.begin(), working.end(), "libx264"), working.end());
    EXPECT_EQ(working.size() + notes.size(), encoder_kinds().size());
    // What a machine lacks is no mistake in the options.
    for (const std::string& line : notes) {
        EXPECT_EQ(line.find("does not know the option"), std::string::npos) << line;
        EXPECT_EQ(line.find("Invalid argument"), std::string::npos) << line;
    }
    EXPECT_TRUE(working_encoders("mjpeg", 320, 240, open, note).empty());
    EXPECT_EQ(working_encoders("libx264", 320, 240, open, note), std::vector<std::string>{"libx264"});
}

// ------------------------------------------------------------------------------------------------ the feed

struct FeedTest : testing::Test {
    Bench bench;
    LaneEncoders encoders{bench.setup({"libx264"}), bench.outputs()};
    LaneFeed feed{encoders};
    std::int64_t now_ns = 1'000'000'000;

    // A viewer that takes what comes, at once.
    LaneRequest request(LaneId lane, unsigned credit = 2, bool key = false) {
        const auto counts = encoders.counts(lane);
        LaneRequest result;
        result.lane = lane;
        result.viewers = 1;
        result.credit = credit;
        result.key = key || counts.frames == 0;
        result.frames = counts.frames;
        result.keys = counts.keys;
        return result;
    }
    void drain(LaneId lane) {
        for (int i = 0; i < 2000 && !encoders.idle(lane); ++i) std::this_thread::sleep_for(1ms);
        ASSERT_TRUE(encoders.idle(lane));
    }
    void serve(const std::vector<LaneRequest>& requests, bool more, bool settled) {
        feed.want(requests, false, 0);
        feed.serve(now_ns, more, settled);
        for (const LaneRequest& one : requests) drain(one.lane);
    }
    Picture textured(std::uint32_t rev) {
        auto bytes = std::make_shared<std::vector<std::uint8_t>>(320 * 240 * 3 / 2, std::uint8_t{120});
        for (int y = 0; y < 240; ++y)
            for (int x = 0; x < 320; ++x)
                (*bytes)[static_cast<std::size_t>(y * 320 + x)] =
                    static_cast<std::uint8_t>(40 + (x * 7919 + y * 104729 + static_cast<int>(rev) * 31) % 97);
        Picture picture = grey_picture(320, 240, rev);
        picture.nv12 = bytes;
        return picture;
    }
};

TEST_F(FeedTest, APictureIsGivenOnceThenRepeatedUntilFinalThenSilence) {
    LaneRequest narrow = request(kLane);
    feed.show(textured(1), now_ns);
    serve({narrow}, false, true);
    EXPECT_EQ(bench.count(), 1u);
    narrow = request(kLane);
    narrow.budget_bytes = 3000;
    serve({narrow}, false, true);
    EXPECT_EQ(bench.count(), 1u) << "not before the picture is quiet";
    EXPECT_LE(feed.rest_in_ns(now_ns), LaneFeed::kQuietNs);
    EXPECT_FALSE(feed.at_rest(now_ns));
    now_ns += LaneFeed::kQuietNs;
    for (int i = 0; i < 50; ++i) {
        narrow = request(kLane);
        narrow.budget_bytes = 3000;
        serve({narrow}, false, true);
        now_ns += 10'000'000;
    }
    EXPECT_LE(bench.count(), 1 + LaneFeed::kRepeats);
    EXPECT_GT(bench.count(), 1u);
    for (std::size_t i = 0; i < bench.frames.size(); ++i) {
        EXPECT_EQ(bench.frames[i].final, i + 1 == bench.frames.size()) << i;
        EXPECT_EQ(bench.frames[i].key, i == 0) << i;
        if (i > 0) {
            EXPECT_LE(bench.frames[i].bytes, 3000u * 5 / 4) << i;
        }
    }
    EXPECT_TRUE(feed.at_rest(now_ns));
    EXPECT_EQ(feed.rest_in_ns(now_ns), INT64_MAX);
}

TEST_F(FeedTest, WhileMoreIsToComeNothingIsRepeatedNorFinal) {
    for (std::uint32_t rev = 1; rev <= 5; ++rev) {
        feed.show(textured(rev), now_ns);
        serve({request(kLane)}, true, false);
        now_ns += 2 * LaneFeed::kQuietNs;
        serve({request(kLane)}, true, false);
    }
    ASSERT_EQ(bench.count(), 5u);
    for (const auto& frame : bench.frames) EXPECT_FALSE(frame.final);
}

TEST_F(FeedTest, FramesOnTheirWayTakeTheirCredit) {
    feed.show(textured(1), now_ns);
    LaneRequest stale = request(kLane, 1);
    EXPECT_FALSE(feed.wanted());
    feed.want({stale}, false, 0);
    EXPECT_TRUE(feed.wanted());
    serve({stale}, false, true);
    EXPECT_FALSE(feed.wanted()) << "its only credit is taken, though the request does not know of it yet";
    feed.show(textured(2), now_ns);
    serve({stale}, false, true);
    EXPECT_EQ(bench.count(), 1u);
    serve({request(kLane, 1)}, false, true);
    EXPECT_EQ(bench.count(), 2u);
    EXPECT_EQ(bench.frames[1].rev, 2u);
}

TEST_F(FeedTest, AJoinerOfAStillPictureGetsAKeyFrameOnce) {
    feed.show(textured(1), now_ns);
    serve({request(kSharedLane)}, false, true);
    LaneRequest joined = request(kSharedLane, 2, true);
    serve({joined}, false, true);
    serve({joined}, false, true);  // the key frame is published, the request does not know it
    ASSERT_EQ(bench.count(), 2u);
    EXPECT_TRUE(bench.frames[1].key);
    EXPECT_EQ(bench.frames[1].rev, 1u);
}

TEST_F(FeedTest, TheLowLaneTakesEverySecondPictureAndTheLast) {
    std::vector<std::uint32_t> low, own;
    for (std::uint32_t rev = 1; rev <= 9; ++rev) {
        feed.show(textured(rev), now_ns);
        serve({request(kLowLane), request(kLane)}, rev != 9, false);
        now_ns += 30'000'000;
    }
    for (const auto& frame : bench.frames) (frame.lane == kLowLane ? low : own).push_back(frame.rev);
    EXPECT_EQ(own.size(), 9u);
    EXPECT_EQ(low, (std::vector<std::uint32_t>{1, 3, 5, 7, 9}));
}

TEST_F(FeedTest, EncodersOfEmptyLanesAreClosed) {
    feed.show(textured(1), now_ns);
    serve({request(kLane)}, false, true);
    EXPECT_EQ(bench.opened["libx264"], 1u);
    serve({}, false, true);
    now_ns += 6'000'000'000;
    serve({}, false, true);
    drain(kLane);
    LaneRequest back = request(kLane, 2, true);
    serve({back}, false, true);
    EXPECT_EQ(bench.opened["libx264"], 2u) << "it was opened anew";
    EXPECT_EQ(bench.count(), 2u);
}

}  // namespace
}  // namespace gonio
