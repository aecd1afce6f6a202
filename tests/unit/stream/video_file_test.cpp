// Video files: as libavformat reads them, and by BT.709's own figures.
#include "server/stream/video_file.h"

#include <gtest/gtest.h>
#include <malloc.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "server/stream/libav.h"

extern "C" {
#include <libavformat/avformat.h>
}

namespace gonio {
namespace {

namespace fs = std::filesystem;

constexpr int kVideoWidth = 64, kVideoHeight = 36, kFrames = 12;

struct Color {
    std::uint8_t r, g, b;
};

class VideoFiles : public testing::Test {
protected:
    void SetUp() override {
        char name[] = "/tmp/gonio_video_XXXXXX";
        folder_ = ::mkdtemp(name);
    }
    void TearDown() override { fs::remove_all(folder_); }

    Result<bool> write(const std::string& name, Color color, std::stop_token stop = {}) const {
        VideoSettings settings{kVideoWidth, kVideoHeight, kFrames, 24000, 1001, 10.0, name.ends_with(".mkv")};
        const auto frame = [&](std::int64_t i) -> Result<std::vector<std::uint8_t>> {
            std::vector<std::uint8_t> rgb;
            for (int p = 0; p < kVideoWidth * kVideoHeight; ++p)
                for (const int c : {color.r, color.g, color.b})
                    rgb.push_back(static_cast<std::uint8_t>(std::max(0, c - static_cast<int>(i))));
            return rgb;
        };
        return write_video(folder_ + "/" + name, settings, frame, stop);
    }
    std::string bytes(const std::string& name) const {
        std::ifstream file(folder_ + "/" + name, std::ios::binary);
        return {std::istreambuf_iterator<char>(file), {}};
    }
    std::string folder_;
};

struct Seen {
    int frames = 0, width = 0, height = 0;
    double fps = 0, seconds = 0;
    int y = -1, cb = -1, cr = -1;  // of the first frame's first pixel
    std::vector<double> times;
};

Seen seen_of(const std::string& path) {
    Seen seen;
    AVFormatContext* format = nullptr;
    if (avformat_open_input(&format, path.c_str(), nullptr, nullptr) < 0) return seen;
    avformat_find_stream_info(format, nullptr);
    const AVStream& stream = *format->streams[0];
    const ContextPointer decoder(avcodec_alloc_context3(avcodec_find_decoder(stream.codecpar->codec_id)));
    avcodec_parameters_to_context(decoder.get(), stream.codecpar);
    avcodec_open2(decoder.get(), nullptr, nullptr);
    seen.width = stream.codecpar->width;
    seen.height = stream.codecpar->height;
    seen.fps = av_q2d(stream.avg_frame_rate);
    seen.seconds = static_cast<double>(format->duration) / AV_TIME_BASE;
    const PacketPointer packet(av_packet_alloc());
    const FramePointer frame(av_frame_alloc());
    for (bool more = true; more;) {
        more = av_read_frame(format, packet.get()) >= 0;
        avcodec_send_packet(decoder.get(), more ? packet.get() : nullptr);
        av_packet_unref(packet.get());
        while (avcodec_receive_frame(decoder.get(), frame.get()) == 0) {
            if (seen.frames++ == 0)
                seen.y = frame->data[0][0], seen.cb = frame->data[1][0], seen.cr = frame->data[2][0];
            seen.times.push_back(static_cast<double>(frame->best_effort_timestamp) * av_q2d(stream.time_base));
        }
    }
    avformat_close_input(&format);
    return seen;
}

TEST_F(VideoFiles, BothKindsHoldEveryFrameAtItsTime) {
    for (const char* name : {"a.mp4", "a.mkv"}) {
        const auto wrote = write(name, {255, 255, 255});
        ASSERT_TRUE(wrote) << wrote.error().text();
        const Seen seen = seen_of(folder_ + "/" + name);
        EXPECT_EQ(seen.frames, kFrames) << name;
        EXPECT_EQ(seen.width, kVideoWidth);
        EXPECT_EQ(seen.height, kVideoHeight);
        EXPECT_NEAR(seen.fps, 24000.0 / 1001.0, 0.01) << name;
        for (std::size_t i = 0; i < seen.times.size(); ++i)
            EXPECT_NEAR(seen.times[i], static_cast<double>(i) * 1001.0 / 24000.0, 0.001) << name;  // Matroska: whole ms
        EXPECT_NEAR(seen.seconds, kFrames * 1001.0 / 24000.0, 0.01) << name;
    }
}

// Rec. ITU-R BT.709-6, item 4.6: 235 is white, 16 black; chroma 16 … 240, 128 none.
TEST_F(VideoFiles, ColoursAreThoseOfBt709) {
    struct Case {
        Color color;
        int y, cb, cr;
    };
    const Case cases[] = {{{255, 255, 255}, 235, 128, 128},
                          {{0, 0, 0}, 16, 128, 128},
                          {{255, 0, 0}, 63, 102, 240},
                          {{0, 255, 0}, 173, 42, 26},
                          {{0, 0, 255}, 32, 240, 118}};
    for (const Case& expected : cases) {
        ASSERT_TRUE(write("c.mp4", expected.color));
        const Seen seen = seen_of(folder_ + "/c.mp4");
        EXPECT_NEAR(seen.y, expected.y, 2);
        EXPECT_NEAR(seen.cb, expected.cb, 2);
        EXPECT_NEAR(seen.cr, expected.cr, 2);
    }
}

TEST_F(VideoFiles, TheSamePicturesMakeTheSameBytes) {
    for (const char* ending : {".mp4", ".mkv"}) {
        const std::string one = std::string("one") + ending, two = std::string("two") + ending;
        ASSERT_TRUE(write(one, {200, 100, 50}));
        ASSERT_TRUE(write(two, {200, 100, 50}));
        EXPECT_GT(bytes(one).size(), 500u);
        EXPECT_EQ(bytes(one), bytes(two)) << ending;
    }
}

// MALLOC_PERTURB_ of mallopt(3): what new memory holds is no part of a video. Pictures move, so that there are
// B-frames.
TEST_F(VideoFiles, WhatMemoryHeldBeforeDoesNotCount) {
    for (const auto& [width, height] : {std::pair(64, 36), {160, 90}, {320, 180}}) {
        const auto frame = [&](std::int64_t i) -> Result<std::vector<std::uint8_t>> {
            std::vector<std::uint8_t> rgb;
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x)
                    for (int c = 0; c < 3; ++c)
                        rgb.push_back(static_cast<std::uint8_t>(
                            127.0 + 60.0 * std::sin(0.2 * x + 0.34 * static_cast<double>(i) + c) +
                            50.0 * std::sin(0.31 * y + 0.3 * static_cast<double>(i)) + (7 * x + 3 * y + 5 * i) % 13));
            return rgb;
        };
        std::vector<std::string> made;
        for (const int held : {0, 85, 170}) {
            ::mallopt(M_PERTURB, held);
            const auto wrote = write_video(folder_ + "/p.mkv", {width, height, 30, 24, 1, 18.0, true}, frame, {});
            ::mallopt(M_PERTURB, 0);
            ASSERT_TRUE(wrote) << wrote.error().text();
            made.push_back(bytes("p.mkv"));
        }
        EXPECT_EQ(made[0], made[1]) << width;
        EXPECT_EQ(made[0], made[2]) << width;
    }
}

TEST_F(VideoFiles, WhatCannotBeIsRefused) {
    const auto none = [](std::int64_t) -> Result<std::vector<std::uint8_t>> { return Error{"gone", "", "", "no"}; };
    EXPECT_EQ(write_video(folder_ + "/x.mp4", {63, 36, 1}, none, {}).error().code, "encoder_unavailable");
    EXPECT_EQ(write_video(folder_ + "/x.mp4", {64, 36, 1}, none, {}).error().code, "gone");
    EXPECT_EQ(write_video(folder_ + "/no/x.mp4", {64, 36, 1}, none, {}).error().code, "file_unwritable");
    std::stop_source stop;
    stop.request_stop();
    EXPECT_EQ(write("x.mp4", {1, 2, 3}, stop.get_token()).error().code, "cancelled");
}

}  // namespace
}  // namespace gonio
