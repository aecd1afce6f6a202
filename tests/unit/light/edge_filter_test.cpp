// Edges that are filtered against what a pixel is covered by: an area that is known.
#include "server/lighting/edge_filter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace gonio::lighting {
namespace {

constexpr int kWidth = 96, kHeight = 64;
constexpr double kDark = 40.0, kBright = 190.0;

struct Luma {
    int width = kWidth, height = kHeight;
    std::vector<std::uint8_t> bytes = std::vector<std::uint8_t>(std::size_t{kWidth} * kHeight, 16);
    std::uint8_t& at(int x, int y) { return bytes[static_cast<std::size_t>(y * width + x)]; }
    void filter() {
        Pool pool(2);
        std::vector<std::uint8_t> scratch;
        filter_edges(width, height, bytes.data(), scratch, pool);
    }
};

// Bright below the line through the picture's middle. Result: the share of a pixel that is, by columns of it.
double covered(double slope, int x, int y) {
    constexpr int kColumns = 64;
    double sum = 0.0;
    for (int i = 0; i < kColumns; ++i) {
        const double line = 0.5 * kHeight + 0.21 + slope * (x + (i + 0.5) / kColumns - 0.5 * kWidth);
        sum += std::clamp(y + 1.0 - line, 0.0, 1.0);
    }
    return sum / kColumns;
}

TEST(EdgeFilter, SlantedEdgesComeNearerToTheirCoverage) {
    for (const double slope : {0.04, 0.13, 0.37, 0.5, 0.9, 1.3, 2.7, 8.0, -0.37, -2.7}) {
        Luma luma;
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x) {
                const double line = 0.5 * kHeight + 0.21 + slope * (x + 0.5 - 0.5 * kWidth);
                luma.at(x, y) = static_cast<std::uint8_t>(y + 0.5 > line ? kBright : kDark);
            }
        Luma filtered = luma;
        filtered.filter();
        double before = 0.0, after = 0.0;
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x) {
                const double truth = kDark + (kBright - kDark) * covered(slope, x, y);
                before += std::pow(luma.at(x, y) - truth, 2.0);
                after += std::pow(filtered.at(x, y) - truth, 2.0);
            }
        const double left = std::sqrt(after / before);
        std::printf("slope %5.2f: %.2f of the error is left\n", slope, left);
        EXPECT_LT(left, 0.75) << slope;
    }
}

TEST(EdgeFilter, WhatIsNoEdgeStays) {
    Luma luma;
    for (int y = 0; y < kHeight; ++y)  // a gradient with dither of two steps, and one weak step
        for (int x = 0; x < kWidth; ++x) luma.at(x, y) = static_cast<std::uint8_t>(60 + x + (x + y) % 3 + (y > 30) * 4);
    Luma filtered = luma;
    filtered.filter();
    EXPECT_EQ(filtered.bytes, luma.bytes);
}

// Of an edge between rows or columns of pixels nothing moves but what is taken for detail, a twentieth.
TEST(EdgeFilter, EdgesAlongPixelsStay) {
    for (const bool rows : {false, true}) {
        Luma luma;
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x)
                luma.at(x, y) = static_cast<std::uint8_t>((rows ? y >= 32 : x >= 41) ? kBright : kDark);
        Luma filtered = luma;
        filtered.filter();
        for (std::size_t i = 0; i < luma.bytes.size(); ++i)
            ASSERT_NEAR(filtered.bytes[i], luma.bytes[i], 0.055 * (kBright - kDark)) << i;
    }
}

// Every pixel lies between what was around it, at the picture's border and in the narrowest one too.
TEST(EdgeFilter, NothingIsBrighterThanWhatWasAround) {
    for (const int side : {16, 18, 50}) {
        Luma luma;
        luma.width = luma.height = side;
        luma.bytes.resize(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
        std::uint32_t random = 7;
        for (std::uint8_t& byte : luma.bytes) byte = static_cast<std::uint8_t>((random = random * 1664525u + 1) >> 24);
        Luma filtered = luma;
        filtered.filter();
        EXPECT_NE(filtered.bytes, luma.bytes);
        for (int y = 0; y < side; ++y)
            for (int x = 0; x < side; ++x) {
                int low = 255, high = 0;
                for (int k = 0; k < 9; ++k) {
                    const int there =
                        luma.at(std::clamp(x + k % 3 - 1, 0, side - 1), std::clamp(y + k / 3 - 1, 0, side - 1));
                    low = std::min(low, there), high = std::max(high, there);
                }
                ASSERT_GE(filtered.at(x, y), low);
                ASSERT_LE(filtered.at(x, y), high);
            }
    }
}

}  // namespace
}  // namespace gonio::lighting
