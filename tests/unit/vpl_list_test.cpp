// VPL sampling and web packing without GL.
#include "server/render/vpl_list.h"

#include <gtest/gtest.h>

#include <bit>
#include <numbers>

#include "server/render/web_buffer.h"

namespace gonio {
namespace {

// A map whose texels all lie at 1 m, facing the centre, with flux that varies over the sphere.
RsmTexels some_map(int size) {
    RsmTexels rsm;
    rsm.size = size;
    const std::size_t count = static_cast<std::size_t>(6) * size * size;
    rsm.radial_depth.assign(count, 1.0f);
    rsm.normal.assign(2 * count, 0);
    for (std::size_t i = 0; i < count; ++i) {
        rsm.flux.emplace_back(0.5f + 0.4f * static_cast<float>(i % 7), 0.3f, 0.1f * static_cast<float>(i % 3), 1e-4f);
    }
    return rsm;
}

glm::dvec3 total_intensity(const VplList& list) {
    glm::dvec3 sum(0.0);
    for (const layouts::Vpl& vpl : list.vpls) sum += glm::dvec3(vpl.intensity);
    return sum;
}

TEST(VplList, KeepsTheFluxAndItsLuminanceExactly) {
    const RsmTexels rsm = some_map(32);
    glm::dvec3 flux(0.0);
    for (const glm::vec4& f : rsm.flux) flux += glm::dvec3(f);
    for (unsigned count : {16u, 256u, 1024u}) {
        const glm::dvec3 sum = total_intensity(sample_vpls(rsm, count)) * std::numbers::pi;
        const glm::dvec3 weights(0.2126, 0.7152, 0.0722);
        EXPECT_NEAR(glm::dot(sum, weights), glm::dot(flux, weights), 1e-5 * glm::dot(flux, weights)) << count;
        EXPECT_NEAR(sum.r, flux.r, 0.15 * flux.r) << count;
    }
}

TEST(VplList, CountsSubsetsAndAlignment) {
    const VplList list = sample_vpls(some_map(16), 1000);
    EXPECT_EQ(list.per_subset, 63u);
    EXPECT_EQ(list.stride * sizeof(layouts::Vpl) % 256, 0u);
    EXPECT_EQ(list.vpls.size(), kVplSubsets * list.stride);
}

TEST(VplList, DarkAndEmptyMapsGiveNothing) {
    RsmTexels rsm = some_map(16);
    for (glm::vec4& f : rsm.flux) f = glm::vec4(0.0f);
    EXPECT_TRUE(sample_vpls(rsm, 256).vpls.empty());
    EXPECT_TRUE(sample_vpls(some_map(16), 0).vpls.empty());
}

TEST(VplList, OneBrightTexelCarriesAll) {
    RsmTexels rsm = some_map(16);
    for (glm::vec4& f : rsm.flux) f = glm::vec4(1e-30f, 1e-30f, 1e-30f, 1e-4f);
    rsm.flux[777] = glm::vec4(2.0f, 2.0f, 2.0f, 1e-4f);
    const glm::dvec3 sum = total_intensity(sample_vpls(rsm, 256)) * std::numbers::pi;
    EXPECT_NEAR(sum.g, 2.0, 1e-5);
}

TEST(VplList, SameMapSameList) {
    const VplList a = sample_vpls(some_map(32), 512), b = sample_vpls(some_map(32), 512);
    ASSERT_EQ(a.vpls.size(), b.vpls.size());
    for (std::size_t i = 0; i < a.vpls.size(); ++i) EXPECT_EQ(a.vpls[i].position_area, b.vpls[i].position_area);
}

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
