// What a viewer's decoder shows of the pictures that were encoded, on a connection without a limit: plain walls without
// blocks while something moves, and nothing to be seen of the coding soon after. `gonio-bench stream` measures it on
// real pictures.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/pictures/coding_error.h"
#include "tests/pictures/lane_viewer.h"

namespace gonio {
namespace {

constexpr int kWidth = 320, kHeight = 240;
constexpr std::int64_t kFrameNs = 16'666'667;

// A plain wall, red to the left, and the shadow of a pillar, in the light of a lamp that moves; a floor of many stones
// that passes by and wants most of the bits. Dithered as display pictures are.
Picture wall(int step, std::uint32_t rev, double more_light = 0.0) {
    std::vector<double> rgb(static_cast<std::size_t>(3 * kWidth * kHeight));
    const double lamp = 110.0 + 3.0 * step;
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            const double dx = (x - lamp) / 160.0, dy = (y - 40.0) / 160.0;
            double light = (0.75 + more_light) / (1.0 + dx * dx + dy * dy);
            const int stone = (x + 3 * step) / 2 * 7919 + y / 2 * 104729;  // the floor passes by
            if (y >= 150) light *= 0.6 + 0.4 * (stone % 97) / 97.0;
            if (std::abs(x - 250.0 + 0.4 * (lamp - 110.0) - 0.1 * y) < 14.0) light *= 0.4;
            const double bayer[4] = {-0.375, 0.125, 0.375, -0.125};
            const double dither = bayer[(x & 1) + 2 * (y & 1)] / 255.0;
            const double colour[3] = {1.0, x < 90 ? 0.25 : 0.95, x < 90 ? 0.2 : 0.9};
            for (int k = 0; k < 3; ++k)
                rgb[static_cast<std::size_t>(3 * (y * kWidth + x) + k)] = light * colour[k] + dither;
        }
    }
    auto nv12 = std::make_shared<std::vector<std::uint8_t>>(static_cast<std::size_t>(kWidth * kHeight * 3 / 2));
    const auto at = [&](int x, int y) { return &rgb[static_cast<std::size_t>(3 * (y * kWidth + x))]; };
    const auto luma = [](const double* c) { return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]; };
    const auto byte = [](double value) {
        return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0)));
    };
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x)
            (*nv12)[static_cast<std::size_t>(y * kWidth + x)] = byte(16.0 + 219.0 * luma(at(x, y)));
    for (int y = 0; y < kHeight; y += 2) {
        for (int x = 0; x < kWidth; x += 2) {
            double mean[3];
            for (int k = 0; k < 3; ++k)
                mean[k] = 0.25 * (at(x, y)[k] + at(x + 1, y)[k] + at(x, y + 1)[k] + at(x + 1, y + 1)[k]);
            const auto to = static_cast<std::size_t>((kHeight + y / 2) * kWidth + x);
            (*nv12)[to] = byte(128.0 + 224.0 / 1.8556 * (mean[2] - luma(mean)));
            (*nv12)[to + 1] = byte(128.0 + 224.0 / 1.5748 * (mean[0] - luma(mean)));
        }
    }
    Picture picture;
    picture.scene_rev = rev;
    picture.width_px = kWidth;
    picture.height_px = kHeight;
    picture.nv12 = nv12;
    return picture;
}

struct StreamQuality : testing::Test {
    test::LaneViewer viewer;
    std::int64_t now_ns = 1'000'000'000;
    static constexpr int kSteps = 16;

    test::CodingError error_of(const test::LaneViewer::Received& received, bool with_flip) {
        return test::coding_error(*viewer.newest().nv12, received.nv12, kWidth, kHeight, with_flip);
    }
    // The lamp moves. Result: the errors of frames but the key frame.
    std::vector<test::CodingError> move() {
        std::vector<test::CodingError> errors;
        for (int step = 0; step < kSteps; ++step, now_ns += kFrameNs) {
            viewer.show(wall(step, static_cast<std::uint32_t>(step + 1)), now_ns);
            const auto received = viewer.serve(now_ns, false);
            EXPECT_TRUE(received);
            if (received && step > 0) errors.push_back(error_of(*received, step == kSteps - 1));
        }
        return errors;
    }
};

TEST_F(StreamQuality, PlainWallsHaveNoBlocksWhileALampMoves) {
    const auto errors = move();
    ASSERT_EQ(errors.size(), static_cast<std::size_t>(kSteps - 1));
    double step = 0.0, least_rgb_db = 100.0;
    for (const test::CodingError& error : errors) {
        step += error.plain_step / static_cast<double>(errors.size());
        least_rgb_db = std::min(least_rgb_db, error.rgb_db);
    }
    // By x264's preset alone these were 1.75, 38.9 and 0.046.
    EXPECT_LT(step, 1.5);
    EXPECT_GT(least_rgb_db, 40.5);
    EXPECT_LT(errors.back().flip, 0.038);
}

// Time is counted, not taken: a fifth of a second is the picture's rest and some frames.
TEST_F(StreamQuality, AtRestThePictureIsVisuallyLosslessWithinASecond) {
    move();
    const std::int64_t began_ns = now_ns - kFrameNs;
    std::optional<double> lossless_s;
    bool final = false;
    while (!final && now_ns - began_ns < 2'000'000'000) {
        const auto received = viewer.serve(now_ns, true);
        if (received) {
            const bool lossless = test::visually_lossless(error_of(*received, true));
            if (!lossless) lossless_s.reset();
            if (lossless && !lossless_s) lossless_s = static_cast<double>(now_ns - began_ns) * 1e-9;
            final = received->final;
        }
        now_ns += kFrameNs;
    }
    EXPECT_TRUE(final);
    ASSERT_TRUE(lossless_s) << "and it stays so to the end";
    EXPECT_LT(*lossless_s, 0.3);
}

// Refining changes a picture at rest: its new pictures are not coarser than what they replace.
TEST_F(StreamQuality, ARefinedPictureIsVisuallyLosslessAtOnce) {
    viewer.show(wall(0, 7), now_ns);
    ASSERT_TRUE(viewer.serve(now_ns, false));
    now_ns += 200'000'000;
    for (int i = 0; i < 3; ++i, now_ns += kFrameNs) viewer.serve(now_ns, false);
    viewer.show(wall(0, 7, 0.02), now_ns);
    const auto refined = viewer.serve(now_ns, false);
    ASSERT_TRUE(refined);
    EXPECT_TRUE(test::visually_lossless(error_of(*refined, true)));
    // What moves again has its usual size.
    viewer.show(wall(1, 8), now_ns);
    const auto moved = viewer.serve(now_ns, false);
    ASSERT_TRUE(moved);
    EXPECT_LT(moved->bytes, refined->bytes);
}

}  // namespace
}  // namespace gonio
