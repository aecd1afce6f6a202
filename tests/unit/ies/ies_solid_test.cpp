#include "ies/solid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "ies/lm63.h"
#include "ies/synthetic.h"

namespace gonio::ies {
namespace {

double volume(const SolidMesh& mesh) {
    double sum = 0.0;
    const auto p = [&](std::uint32_t vertex, int axis) { return double{mesh.positions[vertex * 3 + axis]}; };
    for (std::size_t t = 0; t < mesh.triangles.size(); t += 3) {
        const auto a = mesh.triangles[t], b = mesh.triangles[t + 1], c = mesh.triangles[t + 2];
        sum += p(a, 0) * (p(b, 1) * p(c, 2) - p(b, 2) * p(c, 1)) + p(a, 1) * (p(b, 2) * p(c, 0) - p(b, 0) * p(c, 2)) +
               p(a, 2) * (p(b, 0) * p(c, 1) - p(b, 1) * p(c, 0));
    }
    return sum / 6.0;
}

TEST(IesSolid, IsClosedAndOutward) {
    for (const SyntheticLuminaire& luminaire : synthetic_luminaires()) {
        const auto read = read_lm63(synthetic_lm63(luminaire.name));
        ASSERT_TRUE(read);
        const SolidMesh mesh = photometric_solid(read->web, Angle::degrees(5));
        ASSERT_FALSE(mesh.triangles.empty());
        EXPECT_EQ(mesh.positions.size(), mesh.normals.size());
        // Every edge is met once in each sense: a closed, consistently wound surface.
        std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
        for (std::size_t t = 0; t < mesh.triangles.size(); t += 3) {
            for (int k = 0; k < 3; ++k) ++edges[{mesh.triangles[t + k], mesh.triangles[t + (k + 1) % 3]}];
        }
        for (const auto& [edge, count] : edges) {
            ASSERT_EQ(count, 1);
            ASSERT_EQ((edges.count({edge.second, edge.first})), 1u);
        }
        EXPECT_GT(volume(mesh), 0.0) << luminaire.name;
        for (std::size_t i = 0; i < mesh.normals.size(); i += 3) {
            ASSERT_NEAR(std::hypot(mesh.normals[i], mesh.normals[i + 1], mesh.normals[i + 2]), 1.0F, 1e-5F);
        }
    }
}

TEST(IesSolid, AnIsotropicWebIsASphere) {
    PhotometricWeb web;
    web.v_rad = {0.0, std::numbers::pi};
    web.h_rad = {0.0, 2 * std::numbers::pi};
    web.candela = {100, 100, 100, 100};
    const SolidMesh mesh = photometric_solid(web, Angle::degrees(2));
    const double sphere = 4.0 / 3.0 * std::numbers::pi * 1e6;
    EXPECT_NEAR(volume(mesh), sphere, 2e-3 * sphere);
    for (std::size_t i = 0; i < mesh.positions.size(); i += 3) {
        const float r = std::hypot(mesh.positions[i], mesh.positions[i + 1], mesh.positions[i + 2]);
        ASSERT_NEAR(r, 100.0F, 1e-3F);
        const float along = (mesh.positions[i] * mesh.normals[i] + mesh.positions[i + 1] * mesh.normals[i + 1] +
                             mesh.positions[i + 2] * mesh.normals[i + 2]) /
                            r;
        ASSERT_GT(along, 0.99F);
    }
}

TEST(IesSolid, ADarkWebIsEmpty) {
    PhotometricWeb web;
    web.v_rad = {0.0, 1.0};
    web.h_rad = {0.0, 2 * std::numbers::pi};
    web.candela = {0, 0, 0, 0};
    EXPECT_TRUE(photometric_solid(web, Angle::degrees(5)).triangles.empty());
}

}  // namespace
}  // namespace gonio::ies
