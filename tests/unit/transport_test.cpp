// The transport (server/transport) against closed forms, and each way in which surfels are known to go wrong.
#include "server/transport/transport.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "server/assets/assets.h"
#include "tests/scenes/scenes.h"

namespace gonio::transport {
namespace {

using test::quad;

// Enough where detail proves nothing.
const SurfelSettings kFew{.least = 1000, .most = 4000};

// A scene's transport with all links but the reversed ones, and direct light of an isotropic source of 1 cd.
struct Made {
    explicit Made(const Scene& scene, const SurfelSettings& settings = {})
        : geometry(std::make_shared<const trace::Geometry>(scene.asset)),
          light(geometry->local(scene.lights.at(0).position)),
          builder(geometry, {light}, settings, kMostForwardLinks, false, false) {
        builder.wait();
        transport = builder.newest();
        const Surfels& s = surfels();
        irradiance.direct.assign(s.count, glm::vec4(0.0f));
        for (std::size_t i = 0; i < s.count; ++i) {
            const glm::vec3 p = s.position(i), to = light - p;
            const float d2 = glm::dot(to, to), cosine = glm::dot(to, s.normal(i)) / std::sqrt(d2);
            if (cosine <= 0.0f || glm::dot(to, s.geometric[i]) <= 0.0f) continue;
            if (geometry->occluded(p + s.geometric[i] * (4.0f * geometry->step_off(p)), light)) continue;
            irradiance.direct[i] = glm::vec4(glm::vec3(cosine / d2), 0.0f);
        }
        Pool pool;
        solve(s, transport->links, {}, {}, kAtRest, irradiance, pool);
    }
    const Surfels& surfels() const { return transport->surface->surfels; }
    // Mean over the surfels' areas, of one channel.
    double mean(const std::vector<glm::vec4>& values) const {
        double sum = 0.0, area = 0.0;
        for (std::size_t i = 0; i < surfels().count; ++i) {
            sum += static_cast<double>(surfels().area_m2[i]) * static_cast<double>(values[i].g);
            area += static_cast<double>(surfels().area_m2[i]);
        }
        return sum / area;
    }

    std::shared_ptr<const trace::Geometry> geometry;
    glm::vec3 light;
    Builder builder;
    std::shared_ptr<const Transport> transport;
    Irradiance irradiance;
};

// A closed room of one reflectance from the origin to `size`.
Scene room(const glm::dvec3& size, float reflectance, const glm::dvec3& light) {
    const double x = size.x, y = size.y, z = size.z;
    const Mesh faces[] = {
        quad({0, 0, z}, {x, 0, z}, {x, 0, 0}, {0, 0, 0}), quad({0, y, 0}, {x, y, 0}, {x, y, z}, {0, y, z}),
        quad({0, 0, 0}, {x, 0, 0}, {x, y, 0}, {0, y, 0}), quad({x, 0, z}, {0, 0, z}, {0, y, z}, {x, y, z}),
        quad({0, 0, z}, {0, 0, 0}, {0, y, 0}, {0, y, z}), quad({x, 0, 0}, {x, 0, z}, {x, y, z}, {x, y, 0})};
    std::vector<test::Piece> pieces;
    for (const Mesh& mesh : faces) pieces.push_back({mesh, glm::vec3(reflectance)});
    return test::scene_with(pieces, test::isotropic(1.0), light);
}

TEST(Transport, SurfelsCoverWhatLightReachesAndNothingElse) {
    const Made made(scene_of(make_cornell()));
    const Surfels& s = made.surfels();
    EXPECT_GT(s.count, 20'000u);
    EXPECT_LT(s.count, 40'000u);
    // Every link that meets a surface finds a surfel: no holes. Inside the closed blocks there are none.
    std::size_t met = 0, lost = 0;
    trace::HitPacket hits;
    std::uint16_t ids[trace::kPacket];
    for (std::size_t i = 0; i < s.count; i += 5) {
        const glm::vec3 p = s.position(i);
        const Fan fan = make_fan(p + s.geometric[i] * made.geometry->step_off(p), s.normal(i), s.geometric[i],
                                 fan_directions(77, 0));
        const unsigned found = follow(fan, *made.geometry, s, *made.transport->surface->cells, hits, ids);
        for (unsigned k = 0; k < trace::kPacket; ++k) {
            if ((found >> k & 1u) == 0) continue;
            ++met;
            lost += ids[k] == s.count;
        }
    }
    EXPECT_LT(static_cast<double>(lost) / static_cast<double>(met), 0.005);
    EXPECT_TRUE(reaches(*made.transport, made.light));
    EXPECT_FALSE(reaches(*made.transport, made.geometry->local({-0.85, 0.6, -0.5}))) << "inside the tall block";
}

// A closed room's indirect light is Phi rho / (A (1 - rho)) on the mean, however the room is shaped.
TEST(Transport, AClosedRoomKeepsItsLight) {
    for (const auto& [rho, size] :
         {std::pair(0.3f, glm::dvec3(4, 4, 4)), {0.8f, glm::dvec3(4, 4, 4)}, {0.9f, glm::dvec3(9, 2.5, 3)}}) {
        const Made made(room(size, rho, {0.4 * size.x, 0.6 * size.y, 0.3 * size.z}));
        const double area = 2 * (size.x * size.y + size.y * size.z + size.z * size.x), r = static_cast<double>(rho);
        const double expected = 4 * std::numbers::pi * r / (area * (1 - r));
        EXPECT_NEAR(made.mean(made.irradiance.indirect), expected, 0.01 * expected) << rho << " " << size.x;
    }
}

// Rooms of a centimetre and of a kilometre, and reflectances near one: finite, and no more light than there is.
TEST(Transport, ExtremeRoomsStayFinite) {
    for (const double side_m : {0.01, 1000.0}) {
        for (const float rho : {0.99f}) {
            const Made made(room(glm::dvec3(side_m), rho, glm::dvec3(side_m * 0.3)), kFew);
            const double r = static_cast<double>(rho),
                         most = 4 * std::numbers::pi * r / (6 * side_m * side_m * (1 - r));
            const double mean = made.mean(made.irradiance.indirect);
            EXPECT_TRUE(std::isfinite(mean));
            EXPECT_LT(mean, 1.03 * most) << side_m << " " << rho;
            EXPECT_GT(mean, 0.9 * most) << side_m << " " << rho;
        }
    }
}

// The n-th bounce in a diffuse sphere is rho^n Phi / (4 pi R²).
TEST(Transport, ASphereBounceByBounce) {
    const Made made(
        test::scene_with({{test::inward_sphere(2.0, 64), glm::vec3(0.6f)}}, test::isotropic(1.0), {0.5, 0.3, 0.4}));
    const double one = 0.6 * 4 * std::numbers::pi / (16 * std::numbers::pi);
    EXPECT_NEAR(made.mean(made.irradiance.first), one, 0.01 * one);
    EXPECT_NEAR(made.mean(made.irradiance.indirect), one / 0.4, 0.01 * one / 0.4);
}

// What is shut in a box stays there, to the bit; and the other way round.
TEST(Transport, NothingLeaksThroughAWall) {
    Scene scene = room({4, 3, 4}, 0.8f, {1.0, 2.0, 1.0});
    auto asset = std::make_shared<SceneAsset>(*scene.asset);
    const auto wall = [&](Mesh mesh) {
        mesh.material = 0;
        mesh.bounds = {glm::dvec3(2, 0, 0), glm::dvec3(2.01, 3, 4)};
        asset->meshes.push_back(std::move(mesh));
        Instance instance;
        instance.mesh = static_cast<int>(asset->meshes.size()) - 1;
        asset->instances.push_back(instance);
    };
    wall(quad({2, 0, 4}, {2, 0, 0}, {2, 3, 0}, {2, 3, 4}));
    wall(quad({2.01, 0, 0}, {2.01, 0, 4}, {2.01, 3, 4}, {2.01, 3, 0}));
    scene.asset = asset;
    scene.lights[0].position = {1.0, 2.0, 1.0};
    const auto geometry = std::make_shared<const trace::Geometry>(asset);
    // Both halves have surfels.
    Builder builder(geometry, {geometry->local({1, 2, 1}), geometry->local({3, 2, 1})}, {}, kMostForwardLinks, false,
                    false);
    builder.wait();
    const auto transport = builder.newest();
    const Surfels& s = transport->surface->surfels;
    Irradiance light;
    light.direct.assign(s.count, glm::vec4(0.0f));
    std::size_t lit = 0, dark = 0;
    const auto x_of = [&](std::size_t i) { return static_cast<double>(s.position(i).x) + geometry->origin().x; };
    for (std::size_t i = 0; i < s.count; ++i) {
        if (x_of(i) < 2.005) light.direct[i] = glm::vec4(glm::vec3(1.0f), 0.0f), ++lit;
    }
    Pool pool;
    solve(s, transport->links, {}, {}, kAtRest, light, pool);
    for (std::size_t i = 0; i < s.count; ++i) {
        if (x_of(i) < 2.005) {
            EXPECT_GT(light.indirect[i].g, 1.0f);
        } else {
            EXPECT_EQ(light.indirect[i].g, 0.0f) << s.position(i).x << " " << s.position(i).y << " " << s.position(i).z;
            ++dark;
        }
    }
    EXPECT_GT(lit, 1000u);
    EXPECT_GT(dark, 1000u);
}

// A sheet that is lit from above is dark below, where nothing else reflects.
TEST(Transport, ASheetHasTwoSides) {
    const Made made(test::floor_scene(4.0, 0.8f, test::isotropic(1.0), {0, 1, 0}));
    const Surfels& s = made.surfels();
    ASSERT_GT(s.count, 1000u);
    for (std::size_t i = 0; i < s.count; ++i) {
        EXPECT_GT(s.geometric[i].y, 0.0f) << "walks meet its front alone";
        EXPECT_EQ(made.irradiance.indirect[i].g, 0.0f) << "a plane does not light itself";
    }
}

// With a sixteenth of the memory there are fewer surfels; the light is the same but for its detail.
TEST(Transport, KeepsToItsBytes) {
    const Scene scene = scene_of(make_cornell());
    const auto geometry = std::make_shared<const trace::Geometry>(scene.asset);
    const std::vector<glm::vec3> seeds = {geometry->local(scene.lights[0].position)};
    SurfelSettings settings;
    settings.bytes = std::size_t{16} << 20;
    for (const bool cells : {false, true}) {
        Builder builder(geometry, seeds, settings, kMostLinks, false, cells);
        builder.wait();
        EXPECT_LE(builder.newest()->bytes(), settings.bytes);
        EXPECT_GT(builder.newest()->bytes(), settings.bytes / 2);
        EXPECT_EQ(builder.newest()->links.per_surfel(), kMostForwardLinks);
        EXPECT_GT(builder.newest()->surface->surfels.count, 1000u);
    }
}

// A room whose walls all emit L: E0 = pi L everywhere, and with every bounce E0 / (1 - rho).
TEST(Transport, AWhiteFurnace) {
    Scene scene = room({3, 2, 2.5}, 0.5f, {1, 1, 1});
    auto asset = std::make_shared<SceneAsset>(*scene.asset);
    for (Material& material : asset->materials) material.emissive_nit = glm::vec3(2.0f);
    scene.asset = asset;
    const Made made(scene);
    const Irradiance& light = made.transport->emitted;
    ASSERT_EQ(light.direct.size(), made.surfels().count);
    constexpr double kE0 = 2.0 * std::numbers::pi;
    EXPECT_NEAR(made.mean(light.direct), kE0, 0.002 * kE0);
    EXPECT_NEAR(made.mean(light.indirect), kE0, 0.005 * kE0) << "E0 rho / (1 - rho)";
    for (std::size_t i = 0; i < made.surfels().count; ++i)
        EXPECT_NEAR(static_cast<double>(light.indirect[i].g), kE0, 0.025 * kE0) << i;
}

// What rests does not depend on what was shown before; while it moves, one or two bounces a frame follow.
TEST(Transport, SolvesFromTheFrameBefore) {
    Made made(scene_of(make_cornell()), kFew);
    Pool pool;
    const std::vector<glm::vec4> right = made.irradiance.indirect;
    Irradiance moving = made.irradiance;
    for (glm::vec4& value : moving.direct) value *= 1.05f;
    EXPECT_LE(solve(made.surfels(), made.transport->links, {}, {}, kMoving, moving, pool), 3u);
    EXPECT_FALSE(moving.converged);
    EXPECT_NEAR(made.mean(moving.indirect), 1.05 * made.mean(right), 0.02 * made.mean(right));
    moving.direct = made.irradiance.direct;
    solve(made.surfels(), made.transport->links, {}, {}, kAtRest, moving, pool);
    EXPECT_TRUE(moving.converged);
    EXPECT_TRUE(moving.indirect == right);
}

// Degenerate and coincident triangles neither stop it nor get surfels of their own.
TEST(Transport, DegenerateTriangles) {
    Scene scene = room({4, 3, 4}, 0.5f, {1, 2, 1});
    auto asset = std::make_shared<SceneAsset>(*scene.asset);
    Mesh again = asset->meshes[0];  // the floor once more
    const auto first = static_cast<std::uint32_t>(again.vertices.size());
    again.vertices.push_back({{1, 0, 1}, {0, 1, 0}, {0, 0}});
    again.indices.insert(again.indices.end(), {first, first, first, 0, 0, 1});
    asset->meshes.push_back(again);
    Instance instance;
    instance.mesh = static_cast<int>(asset->meshes.size()) - 1;
    asset->instances.push_back(instance);
    scene.asset = asset;
    const Made made(scene, kFew);
    EXPECT_GT(made.surfels().count, 1000u);
    for (const glm::vec4& value : made.irradiance.indirect) EXPECT_TRUE(std::isfinite(value.g));
}

// Nobody looks, nobody asks: nothing is made; and it ends though it is held.
TEST(Transport, IsHeldAndGoesOn) {
    const auto geometry = std::make_shared<const trace::Geometry>(make_cornell());
    const std::vector<glm::vec3> seeds = {geometry->local({0.0, 1.0, 0.0})};
    Builder held(geometry, seeds, kFew, kMostForwardLinks, false, false);
    held.hold(true);
    Builder free(geometry, seeds, kFew, kMostForwardLinks, false, false);
    free.wait();
    EXPECT_EQ(held.newest(), nullptr);
    held.hold(false);
    held.wait();
    ASSERT_NE(held.newest(), nullptr);
    EXPECT_EQ(held.newest()->surface->surfels.count, free.newest()->surface->surfels.count);
    Builder never(geometry, seeds, kFew, kMostForwardLinks, false, false);
    never.hold(true);
}

}  // namespace
}  // namespace gonio::transport
