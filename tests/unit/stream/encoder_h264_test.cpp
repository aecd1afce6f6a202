// H.264 as browsers need it: in-band headers on every IDR, IDR on demand only, nothing held back, the right picture.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <random>
#include <string>

#include "server/stream/encoder.h"
#include "server/stream/h264_stream.h"
#include "tests/pictures/decoder.h"

namespace gonio {
namespace {

// A smooth gradient with a bright disk whose place depends on `step`.
Picture test_picture(int width, int height, int step) {
    auto nv12 = std::make_shared<std::vector<std::uint8_t>>(static_cast<std::size_t>(width * height * 3 / 2));
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const double dx = x - width / 4.0 - 4.0 * step, dy = y - height / 2.0;
            const double glow = 160.0 * std::exp(-(dx * dx + dy * dy) / (width * height / 40.0));
            (*nv12)[static_cast<std::size_t>(y * width + x)] = static_cast<std::uint8_t>(24 + 40.0 * x / width + glow);
        }
    for (int i = width * height; i < width * height * 3 / 2; i += 2) {
        (*nv12)[static_cast<std::size_t>(i)] = 110;
        (*nv12)[static_cast<std::size_t>(i + 1)] = 150;
    }
    Picture picture;
    picture.scene_rev = static_cast<std::uint32_t>(100 + step);
    picture.width_px = width;
    picture.height_px = height;
    picture.nv12 = nv12;
    picture.drained_ns = 10;
    picture.rendered_ns = 20;
    return picture;
}

// NAL unit types of an Annex B access unit, in order (ITU-T H.264 Table 7-1: 1 slice, 5 IDR, 6 SEI, 7 SPS, 8 PPS).
std::vector<int> nal_types(const EncodedFrame& frame) {
    std::vector<int> types;
    for (std::size_t i = 0; i + 3 < frame.data.size(); ++i)
        if (frame.data[i] == std::byte{0} && frame.data[i + 1] == std::byte{0} && frame.data[i + 2] == std::byte{1})
            types.push_back(std::to_integer<int>(frame.data[i + 3]) & 0x1f);
    return types;
}

bool contains(const std::vector<int>& types, int type) {
    return std::find(types.begin(), types.end(), type) != types.end();
}

// Reads an SPS far enough to reach bitstream_restriction (ITU-T H.264 7.3.2.1.1 and E.1.1).
class SpsReader {
public:
    explicit SpsReader(const EncodedFrame& frame) {
        std::size_t start = 0;
        while (start + 3 < frame.data.size() && !(at(frame, start) == 0 && at(frame, start + 1) == 0 &&
                                                  at(frame, start + 2) == 1 && (at(frame, start + 3) & 0x1f) == 7))
            ++start;
        for (std::size_t i = start + 4; i < frame.data.size(); ++i) {
            if (i + 2 < frame.data.size() && at(frame, i) == 0 && at(frame, i + 1) == 0 && at(frame, i + 2) <= 1) break;
            if (at(frame, i) == 3 && at(frame, i - 1) == 0 && at(frame, i - 2) == 0) continue;  // emulation prevention
            bytes_.push_back(at(frame, i));
        }
    }
    unsigned bits(int count) {
        unsigned value = 0;
        for (; count > 0; --count, ++position_)
            value = value << 1 | (bytes_.at(position_ / 8) >> (7 - position_ % 8) & 1u);
        return value;
    }
    unsigned ue() {
        int zeros = 0;
        while (bits(1) == 0) ++zeros;
        return (1u << zeros) - 1 + bits(zeros);
    }

private:
    static unsigned at(const EncodedFrame& frame, std::size_t i) { return std::to_integer<unsigned>(frame.data[i]); }
    std::vector<unsigned> bytes_;
    std::size_t position_ = 0;
};

double luma_psnr_db(const Picture& picture, const test::Decoded& decoded) {
    double sum = 0;
    for (int y = 0; y < picture.height_px; ++y)
        for (int x = 0; x < picture.width_px; ++x) {
            const int difference = (*picture.nv12)[static_cast<std::size_t>(y * picture.width_px + x)] -
                                   decoded.nv12[static_cast<std::size_t>(y * picture.width_px + x)];
            sum += difference * difference;
        }
    return 10 * std::log10(255.0 * 255.0 * picture.width_px * picture.height_px / std::max(sum, 1e-9));
}

TEST(H264Encoder, FirstFrameIsAnIdrWithItsHeaders) {
    auto encoder = H264Encoder::open(320, 240);
    ASSERT_TRUE(encoder) << encoder.error().text();
    auto frame = (*encoder)->encode(test_picture(320, 240, 0), false);
    ASSERT_TRUE(frame) << frame.error().text();
    EXPECT_TRUE(frame->key);
    const auto types = nal_types(*frame);
    EXPECT_TRUE(contains(types, 7) && contains(types, 8) && contains(types, 5));
    EXPECT_EQ(frame->scene_rev, 100u);
    EXPECT_EQ(frame->drained_ns, 10);
    EXPECT_EQ(frame->rendered_ns, 20);
    EXPECT_GT(frame->encoded_ns, 20);
}

TEST(H264Encoder, CodecStringIsConstrainedBaselineAndTheSpsSaysNoReordering) {
    auto encoder = H264Encoder::open(800, 800);
    ASSERT_TRUE(encoder) << encoder.error().text();
    EXPECT_EQ((*encoder)->codec_string(), "avc1.42C020");  // 2500 macroblocks at 60/s need level 3.2
    auto frame = (*encoder)->encode(test_picture(800, 800, 0), false);
    ASSERT_TRUE(frame);
    SpsReader sps(*frame);
    EXPECT_EQ(sps.bits(8), 66u);            // profile_idc: Baseline
    EXPECT_EQ(sps.bits(8) & 0xC0u, 0xC0u);  // constraint_set0 and 1: Constrained Baseline
    EXPECT_EQ(sps.bits(8), 32u);            // level_idc
    sps.ue();                               // seq_parameter_set_id
    sps.ue();                               // log2_max_frame_num
    EXPECT_EQ(sps.ue(), 2u);                // pic_order_cnt_type: output order is decoding order
    EXPECT_EQ(sps.ue(), 1u);                // max_num_ref_frames
    sps.bits(1);
    EXPECT_EQ(sps.ue() + 1, 50u);  // macroblocks across
    EXPECT_EQ(sps.ue() + 1, 50u);
    EXPECT_EQ(sps.bits(1), 1u);  // frame_mbs_only
    sps.bits(1);
    EXPECT_EQ(sps.bits(1), 0u);  // no cropping
    ASSERT_EQ(sps.bits(1), 1u);  // vui_parameters_present
    if (sps.bits(1)) {           // aspect ratio
        EXPECT_NE(sps.bits(8), 255u);
    }
    if (sps.bits(1)) sps.bits(1);  // overscan
    ASSERT_EQ(sps.bits(1), 1u);    // video_signal_type_present
    sps.bits(3);
    EXPECT_EQ(sps.bits(1), 0u);  // limited range
    ASSERT_EQ(sps.bits(1), 1u);
    EXPECT_EQ(sps.bits(8), 1u);                                // primaries BT.709
    EXPECT_EQ(sps.bits(8), 13u);                               // transfer IEC 61966-2-1
    EXPECT_EQ(sps.bits(8), 1u);                                // matrix BT.709
    if (sps.bits(1)) sps.ue(), sps.ue();                       // chroma location
    if (sps.bits(1)) sps.bits(32), sps.bits(32), sps.bits(1);  // timing
    ASSERT_EQ(sps.bits(1), 0u);                                // NAL HRD
    ASSERT_EQ(sps.bits(1), 0u);                                // VCL HRD
    sps.bits(1);
    ASSERT_EQ(sps.bits(1), 1u);  // bitstream_restriction
    sps.bits(1);
    sps.ue(), sps.ue(), sps.ue(), sps.ue();
    EXPECT_EQ(sps.ue(), 0u);  // max_num_reorder_frames
}

TEST(H264Encoder, IdrComesOnDemandAndOnlyThen) {
    auto encoder = H264Encoder::open(320, 240);
    ASSERT_TRUE(encoder);
    for (int step = 0; step < 300; ++step) {
        auto frame = (*encoder)->encode(test_picture(320, 240, step % 40), step == 120);
        ASSERT_TRUE(frame) << frame.error().text();
        const auto types = nal_types(*frame);
        const bool due = step == 0 || step == 120;
        ASSERT_EQ(frame->key, due) << "frame " << step;
        ASSERT_EQ(contains(types, 5), due) << "frame " << step;
        ASSERT_EQ(contains(types, 7), due) << "frame " << step;
    }
}

TEST(H264Encoder, EveryPictureComesBackAtOnceInOrderAndRight) {
    auto encoder = H264Encoder::open(320, 240);
    ASSERT_TRUE(encoder);
    test::Decoder decoder;
    double worst_db = 1e9;
    for (int step = 0; step < 40; ++step) {
        const Picture picture = test_picture(320, 240, step);
        auto frame = (*encoder)->encode(picture, false);
        ASSERT_TRUE(frame);
        const auto decoded = decoder.decode(*frame);
        ASSERT_TRUE(decoded) << "held back at " << step;
        ASSERT_EQ(decoded->number, step);
        ASSERT_EQ(decoded->width_px, 320);
        ASSERT_EQ(decoded->height_px, 240);
        worst_db = std::min(worst_db, luma_psnr_db(picture, *decoded));
        EXPECT_EQ(decoded->reorder_frames, 0);
        EXPECT_EQ(decoded->nv12[320 * 240], 110);  // flat chroma survives
        EXPECT_EQ(decoded->nv12[320 * 240 + 1], 150);
    }
    RecordProperty("worst_psnr_db", std::to_string(worst_db));
    EXPECT_GT(worst_db, 30.0);
}

// The pixels are sRGB's: its primaries, which are BT.709's, and its curve; the matrix of ycbcr_709() and its limited
// range (shaders/lib/display.glsl); chroma in the middle of the 2×2 pixels that nv12.frag averages.
TEST(H264Encoder, TheStreamSaysWhatColoursItsPixelsHave) {
    auto encoder = H264Encoder::open(64, 64);
    ASSERT_TRUE(encoder);
    test::Decoder decoder;
    const auto decoded = decoder.decode(*(*encoder)->encode(test_picture(64, 64, 0), true));
    ASSERT_TRUE(decoded);
    EXPECT_EQ(decoded->primaries, 1);
    EXPECT_EQ(decoded->transfer, 13);
    EXPECT_EQ(decoded->matrix, 1);
    EXPECT_FALSE(decoded->full_range);
    EXPECT_EQ(decoded->chroma_location, 1);
}

TEST(H264Encoder, ADecoderJoinsAtAnIdr) {
    auto encoder = H264Encoder::open(64, 64);
    ASSERT_TRUE(encoder);
    for (int step = 0; step < 5; ++step) ASSERT_TRUE((*encoder)->encode(test_picture(64, 64, step), false));
    test::Decoder decoder;
    const Picture picture = test_picture(64, 64, 6);
    auto frame = (*encoder)->encode(picture, true);
    ASSERT_TRUE(frame);
    const auto decoded = decoder.decode(*frame);
    ASSERT_TRUE(decoded);
    EXPECT_GT(luma_psnr_db(picture, *decoded), 30.0);
}

// Textured, so that the limit matters.
Picture noisy_picture(int step) {
    Picture picture = test_picture(640, 640, step);
    auto bytes = std::make_shared<std::vector<std::uint8_t>>(*picture.nv12);
    std::minstd_rand generator(static_cast<unsigned>(step) + 1);
    const auto noise = [&] { return static_cast<unsigned>(generator()) << 1; };
    for (int y = 0; y < 640; ++y)
        for (int x = 0; x < 640; ++x) {
            const int grain = static_cast<int>(noise() >> 27);
            auto& luma = (*bytes)[static_cast<std::size_t>(y * 640 + x)];
            luma = static_cast<std::uint8_t>(std::min(235, luma + grain));
        }
    picture.nv12 = bytes;
    return picture;
}

TEST(H264Encoder, ARunningEncoderTakesAnotherBudgetWithoutAnIdr) {
    auto encoder = H264Encoder::open(640, 640);
    ASSERT_TRUE(encoder);
    test::Decoder decoder;
    const auto encode = [&](int step, std::uint32_t budget_bytes) {
        auto frame = (*encoder)->encode(noisy_picture(step), FrameRequest{false, budget_bytes, kCrf});
        EXPECT_TRUE(frame);
        EXPECT_EQ(frame->key, step == 0);
        EXPECT_TRUE(decoder.decode(*frame));
        return frame->data.size();
    };
    std::size_t free = 0;
    for (int step = 0; step < 10; ++step) free = encode(step, 0);
    ASSERT_GT(free, 14'000u) << "or the limits below say nothing";
    for (const std::uint32_t budget : {12'000u, 6'000u}) {
        encode(10, budget);  // the buffer of one frame adapts
        for (int step = 11; step < 20; ++step) EXPECT_LT(encode(step, budget), budget * 5 / 4) << budget;
    }
    for (int step = 20; step < 24; ++step) free = encode(step, 0);
    EXPECT_GT(free, 14'000u) << "and back";
}

TEST(H264Encoder, RepeatsOfAPictureSharpenItUntilNothingIsLeft) {
    auto encoder = H264Encoder::open(640, 640);
    ASSERT_TRUE(encoder);
    test::Decoder decoder;
    std::optional<test::Decoded> decoded;
    const auto show = [&](const Picture& picture, double crf) {
        decoded = decoder.decode(*(*encoder)->encode(picture, FrameRequest{false, 6'000, crf}));
        ASSERT_TRUE(decoded);
    };
    for (int step = 0; step < 10; ++step) show(noisy_picture(step), kCrf);
    const Picture still = noisy_picture(9);
    const double moving_db = luma_psnr_db(still, *decoded);
    for (int repeat = 0; repeat < 8; ++repeat) show(still, kStillCrf);
    EXPECT_GT(luma_psnr_db(still, *decoded), moving_db + 1.0);
}

TEST(StreamInfo, SizeAndCodecAreReadFromTheSps) {
    for (const auto& [width, height] : {std::pair{320, 240}, {800, 600}, {98, 50}, {1280, 720}}) {
        auto encoder = H264Encoder::open(width, height);
        ASSERT_TRUE(encoder);
        const auto frame = (*encoder)->encode(test_picture(width, height, 0), true);
        ASSERT_TRUE(frame);
        const auto info = read_stream_info(frame->data);
        ASSERT_TRUE(info);
        EXPECT_EQ(info->width_px, width);
        EXPECT_EQ(info->height_px, height);
        EXPECT_EQ(info->codec, (*encoder)->codec_string());
        // Cut anywhere, it is refused or says what it said.
        for (std::size_t bytes = 0; bytes < 40; ++bytes) {
            const auto cut = read_stream_info(std::span(frame->data).first(bytes));
            if (cut) {
                EXPECT_EQ(cut->codec, info->codec);
            }
        }
    }
    EXPECT_FALSE(read_stream_info({}));
}

// ITU-T H.264 Table A-1: 800×800 is 2,500 macroblocks, at 60/s 150,000 of the 216,000 of level 3.2.
TEST(StreamInfo, TheLevelFollowsFromTheSize) {
    EXPECT_EQ(level_idc(800, 800, 60), 32);
    EXPECT_EQ(level_idc(1920, 1080, 60), 42);
    EXPECT_EQ(level_idc(1920, 1080, 30), 40);
    EXPECT_EQ(level_idc(4096, 4096, 60), 60);
    EXPECT_EQ(level_idc(176, 144, 15), 10);
    EXPECT_EQ(level_idc(4096, 16, 1), 40) << "width alone: 256 macroblocks are at most sqrt(8 · 8,192)";
}

TEST(H264Encoder, WrongSizesAreRefused) {
    for (const auto& [width, height] : {std::pair{0, 0}, {15, 16}, {17, 16}, {16, 8192}, {-2, 16}}) {
        auto encoder = H264Encoder::open(width, height);
        ASSERT_FALSE(encoder);
        EXPECT_EQ(encoder.error().code, "encoder_unavailable");
    }
    auto encoder = H264Encoder::open(64, 64);
    ASSERT_TRUE(encoder);
    auto frame = (*encoder)->encode(test_picture(32, 32, 0), false);
    ASSERT_FALSE(frame);
    EXPECT_EQ(frame.error().code, "encoder_failed");
    EXPECT_TRUE((*encoder)->encode(test_picture(64, 64, 0), false));  // and it goes on
}

}  // namespace
}  // namespace gonio
