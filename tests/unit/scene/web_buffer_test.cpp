// Web packing without GL.
#include "server/scene/web_buffer.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <numbers>
#include <random>

#include "server/scene/direction_table.h"

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
    const auto reached = [](const ies::PhotometricWeb& web) {
        return reached_faces(DirectionTable(web).lit_directions(), glm::mat3(1.0f));
    };
    EXPECT_EQ(reached(cone(10.0)), 1u << 5);
    EXPECT_EQ(reached(cone(60.0)), 63u & ~(1u << 4));
    EXPECT_EQ(reached(cone(170.0)), 63u);
    ies::PhotometricWeb dark = cone(10.0);
    for (float& c : dark.candela) c = 0.0f;
    EXPECT_EQ(reached(dark), 0u);
}

// A turn of a luminaire costs a look at these: few, however fine the web is.
TEST(WebBuffer, ReachedFacesHoldEveryRayOfATurnedBeam) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> any(0.0f, 1.0f);
    for (const float half_deg : {3.0f, 25.0f, 80.0f}) {
        const std::vector<glm::vec3> lit = DirectionTable(cone(half_deg)).lit_directions();
        EXPECT_LT(lit.size(), 4000u);
        for (int turn = 0; turn < 200; ++turn) {
            const glm::mat3 world_from_light(
                glm::angleAxis(6.28f * any(random),
                               glm::normalize(glm::vec3(any(random) - 0.5f, any(random) - 0.5f, any(random) + 1e-3f))));
            const unsigned faces = reached_faces(lit, world_from_light);
            for (int ray = 0; ray < 100; ++ray) {
                const float angle = glm::radians(half_deg) * any(random), around = 6.2832f * any(random);
                const glm::vec3 w = world_from_light * glm::vec3(std::sin(angle) * std::cos(around),
                                                                 std::sin(angle) * std::sin(around), -std::cos(angle));
                int axis = 0;
                for (int k = 1; k < 3; ++k)
                    if (std::abs(w[k]) > std::abs(w[axis])) axis = k;
                EXPECT_TRUE(faces >> (2 * axis + (w[axis] >= 0.0f ? 0 : 1)) & 1u) << half_deg;
            }
        }
    }
}

TEST(WebBuffer, MaskFollowsTheFinestFeature) {
    EXPECT_EQ(mask_face_size(cone(0.5)), 1024);  // 1 % of half a degree is finer than the cap allows
    ies::PhotometricWeb coarse;
    for (int i = 0; i <= 12; ++i) coarse.v_rad.push_back(std::numbers::pi * i / 12);
    coarse.h_rad = {0, 2 * std::numbers::pi};
    EXPECT_EQ(mask_face_size(coarse), 64);
}

TEST(WebBuffer, HeaderAndPeak) {
    const auto words = pack_web(cone(30.0), 100.0);
    EXPECT_EQ(words[0], 0u);
    EXPECT_EQ(words[1], 4u);
    EXPECT_EQ(words[2], 2u);
    EXPECT_EQ(words.size(), 4u + 4 + 2 + 2 * words[3] + 8);
    EXPECT_EQ(std::bit_cast<float>(words[words.size() - 8]), 1.0f);
}

}  // namespace
}  // namespace gonio
