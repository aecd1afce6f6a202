// Web packing without GL.
#include "server/render/web_buffer.h"

#include <gtest/gtest.h>

#include <bit>
#include <numbers>

namespace gonio {
namespace {

ies::PhotometricWeb cone(double half_deg) {
    ies::PhotometricWeb web;
    const double edge = half_deg * std::numbers::pi / 180;
    web.v_rad = {0.0, edge, edge * 1.01, std::numbers::pi};
    web.h_rad = {0.0, 2 * std::numbers::pi};
    for (int h = 0; h < 2; ++h) web.candela.insert(web.candela.end(), {100, 100, 0, 0});
    return web;
}

TEST(WebBuffer, ReachedFacesOfANarrowBeam) {
    // World axes = luminaire axes: the beam goes to -Z, face 5.
    const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    EXPECT_EQ(reached_faces(cone(10.0), identity), 1u << 5);
    EXPECT_EQ(reached_faces(cone(60.0), identity), 63u & ~(1u << 4));
    EXPECT_EQ(reached_faces(cone(170.0), identity), 63u);
    ies::PhotometricWeb dark = cone(10.0);
    for (float& c : dark.candela) c = 0.0f;
    EXPECT_EQ(reached_faces(dark, identity), 0u);
}

TEST(WebBuffer, MaskFollowsTheFinestFeature) {
    EXPECT_EQ(mask_face_size(cone(0.5)), 1024);  // 1 % of half a degree is finer than the cap allows
    ies::PhotometricWeb coarse;
    for (int i = 0; i <= 12; ++i) coarse.v_rad.push_back(std::numbers::pi * i / 12);
    coarse.h_rad = {0, 2 * std::numbers::pi};
    EXPECT_EQ(mask_face_size(coarse), 64);
}

TEST(WebBuffer, HeaderAndPeak) {
    const auto words = pack_web(cone(30.0));
    EXPECT_EQ(words[0], 0u);
    EXPECT_EQ(words[1], 4u);
    EXPECT_EQ(words[2], 2u);
    EXPECT_EQ(words.size(), 4u + 4 + 2 + 2 * words[3] + 8);
    EXPECT_EQ(std::bit_cast<float>(words[words.size() - 8]), 1.0f);
}

}  // namespace
}  // namespace gonio
