// The transport (server/transport) against closed forms, and each way in which its light is known to go wrong.
#include "server/transport/transport.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "server/assets/assets.h"
#include "server/scene/scene.h"
#include "server/trace/sampler.h"
#include "server/transport/fixed_point.h"
#include "tests/unit/light/made_transport.h"

namespace gonio::transport {
namespace {

using test::quad;

// A closed room's indirect light is Phi rho / (A (1 - rho)) on the mean, however the room is shaped.
TEST(Transport, AClosedRoomKeepsItsLight) {
    struct Case {
        float rho;
        glm::dvec3 size;
        double tolerance;
    };
    // Light that bounces a hundred times multiplies what each bounce is off by.
    for (const auto& [rho, size, tolerance] : {Case{0.3f, glm::dvec3(4, 4, 4), 0.01},
                                               {0.8f, glm::dvec3(4, 4, 4), 0.01},
                                               {0.9f, glm::dvec3(9, 2.5, 3), 0.01},
                                               {0.95f, glm::dvec3(4, 3, 5), 0.02},
                                               {0.99f, glm::dvec3(4, 3, 5), 0.02}}) {
        const Made made(room(size, rho, {0.4 * size.x, 0.6 * size.y, 0.3 * size.z}), kFew);
        const double area = 2 * (size.x * size.y + size.y * size.z + size.z * size.x), r = static_cast<double>(rho);
        const double expected = 4 * std::numbers::pi * r / (area * (1 - r));
        EXPECT_NEAR(made.mean(made.irradiance.indirect), expected, tolerance * expected) << rho << " " << size.x;
        std::printf("reflectance %.2f: %u bounces, residual %.2g, estimate of the rest %.2g\n", r,
                    made.irradiance.solved.bounces, static_cast<double>(made.irradiance.solved.residual),
                    static_cast<double>(made.irradiance.solved.error));
        EXPECT_LT(made.irradiance.solved.bounces, 200u);
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
        test::scene_with({{test::inward_sphere(2.0, 64), glm::vec3(0.6f)}}, test::isotropic(1.0), {0.5, 0.3, 0.4}),
        kFew);
    const double one = 0.6 * 4 * std::numbers::pi / (16 * std::numbers::pi);
    EXPECT_NEAR(made.mean(made.irradiance.first), one, 0.01 * one);
    EXPECT_NEAR(made.mean(made.irradiance.indirect), one / 0.4, 0.01 * one / 0.4);
}

// Whatever light falls on the wall of a sphere, one bounce spreads it evenly. Here nearly half of it falls on small
// surfels around a source 3 cm from the wall, which few links meet.
TEST(Transport, ABrightSpotLightsEverySurfelOfASphere) {
    const Made made(
        test::scene_with({{test::inward_sphere(2.0, 64), glm::vec3(0.6f)}}, test::isotropic(1.0), {0.0, 0.0, 1.97}),
        kFew);
    const Surfels& surfels = made.surfels();
    ASSERT_GT(surfels.all_crowded.size(), 20u);
    double flux_lm = 0.0;
    for (std::size_t i = 0; i < surfels.count; ++i)
        flux_lm += static_cast<double>(made.irradiance.direct[i].g * made.transport->met_m2[i]);
    EXPECT_NEAR(flux_lm, 4.0 * std::numbers::pi, 0.03 * 4.0 * std::numbers::pi) << "centres are lit 4 % more";
    const double expected = 0.6 * flux_lm / (16.0 * std::numbers::pi);
    const auto rms = [&](const std::vector<glm::vec4>& first) {  // of those that are not crowded
        double squares = 0.0, count = 0.0;
        for (std::size_t i = 0; i < surfels.count; ++i) {
            if (surfels.crowded(i)) continue;
            squares += std::pow(static_cast<double>(first[i].g) / expected - 1.0, 2.0);
            count += 1.0;
        }
        return std::sqrt(squares / count);
    };
    Links plain = made.transport->links;
    plain.crowded = nullptr;
    Irradiance by_links;
    by_links.direct = made.irradiance.direct;
    Pool pool;
    solve(surfels, plain, {}, {}, kAtRest, by_links, pool);
    std::printf("one bounce: rms %.3f, by links that meet the spot %.3f\n", rms(made.irradiance.first),
                rms(by_links.first));
    EXPECT_LT(rms(made.irradiance.first), 0.15);
    EXPECT_LT(rms(made.irradiance.first), 0.25 * rms(by_links.first));
    // By reciprocity what crowded surfels send comes to all others, none of it lost. The area of each is a mean of some
    // fifty points, which says as much of a single one.
    std::vector<double> received_m2(surfels.count, 0.0);
    for (std::size_t n = 0; n < surfels.all_crowded.size(); ++n)
        made.transport->links.crowded->each(n, [&](std::size_t i, float form_factor) {
            received_m2[surfels.all_crowded[n].id] += static_cast<double>(form_factor * made.transport->met_m2[i]);
        });
    double sent_lm = 0.0, received_lm = 0.0;
    for (const Surfels::Crowded& one : surfels.all_crowded) {
        const double own_m2 = static_cast<double>(made.transport->met_m2[one.id]),
                     lux = static_cast<double>(made.irradiance.direct[one.id].g);
        EXPECT_NEAR(received_m2[one.id], own_m2, 0.2 * own_m2) << one.id;
        sent_lm += own_m2 * lux, received_lm += received_m2[one.id] * lux;
    }
    EXPECT_NEAR(received_lm, sent_lm, 0.03 * sent_lm);
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
    Builder builder(geometry, {geometry->local({1, 2, 1}), geometry->local({3, 2, 1})}, kFew, kMostForwardLinks, false,
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
    do {
        solve(s, transport->links, {}, {}, kAtRest, light, pool);
    } while (light.resumes);
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
    const Made made(test::floor_scene(4.0, 0.8f, test::isotropic(1.0), {0, 1, 0}), kFew);
    const Surfels& s = made.surfels();
    ASSERT_GT(s.count, 1000u);
    for (std::size_t i = 0; i < s.count; ++i) {
        EXPECT_GT(s.geometric[i].y, 0.0f) << "walks meet its front alone";
        EXPECT_EQ(made.irradiance.indirect[i].g, 0.0f) << "a plane does not light itself";
    }
}

// Nothing that light reaches: no surfels, and nothing is read of them.
TEST(Transport, NoSurfels) {
    const Made made(test::scene_with({{quad({-1, 0, -1}, {1, 0, -1}, {1, 0, 1}, {-1, 0, 1}), glm::vec3(0.5f)}},
                                     test::isotropic(1.0), {0, 0, 5}));
    EXPECT_EQ(made.surfels().count, 0u);
    EXPECT_TRUE(made.transport->met_m2.empty());
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
    const Made made(scene, kFew);
    const Irradiance& light = made.transport->emitted;
    ASSERT_EQ(light.direct.size(), made.surfels().count);
    constexpr double kE0 = 2.0 * std::numbers::pi;
    EXPECT_NEAR(made.mean(light.direct), kE0, 0.002 * kE0);
    EXPECT_NEAR(made.mean(light.indirect), kE0, 0.005 * kE0) << "E0 rho / (1 - rho)";
    for (std::size_t i = 0; i < made.surfels().count; ++i)
        EXPECT_NEAR(static_cast<double>(light.indirect[i].g), kE0, 0.025 * kE0) << i;
}

// Haze that scatters 3 lx to every surface of a closed room of reflectance 1/2: surfaces reflect that light too, to 3 /
// (1 - 1/2) lx in all.
TEST(Transport, SurfacesReflectTheLightOfHaze) {
    const Made made(room({3, 2, 2.5}, 0.5f, {1, 1, 1}), kFew);
    Pool pool;
    Irradiance light;
    light.direct.assign(made.surfels().count, glm::vec4(0.0f));
    light.haze.assign(made.surfels().count, glm::vec4(3.0f, 3.0f, 3.0f, 0.0f));
    made.solve_to_the_end(light, pool);
    for (std::size_t i = 0; i < made.surfels().count; ++i)
        EXPECT_NEAR(static_cast<double>(light.indirect[i].g), 6.0, 0.03) << i;
}

// What rests does not depend on what was shown before; while it moves, one or two bounces a frame follow.
TEST(Transport, SolvesFromTheFrameBefore) {
    Made made(scene_of(make_cornell()), kFew);
    Pool pool;
    const std::vector<glm::vec4> right = made.irradiance.indirect;
    Irradiance moving = made.irradiance;
    for (glm::vec4& value : moving.direct) value *= 1.05f;
    solve(made.surfels(), made.transport->links, {}, {}, kMoving, moving, pool);
    EXPECT_LE(moving.solved.bounces, 3u);
    EXPECT_FALSE(moving.converged);
    EXPECT_NEAR(made.mean(moving.indirect), 1.05 * made.mean(right), 0.02 * made.mean(right));
    moving.direct = made.irradiance.direct;
    made.solve_to_the_end(moving, pool);
    EXPECT_TRUE(moving.converged);
    EXPECT_TRUE(moving.indirect == right);
}

// Two rooms of 3 × 3 × 3 m, the wall between them 0.1 m thick, with a hole of 0.1 × 0.1 m.
Scene keyhole(float reflectance) {
    std::vector<test::Placed> pieces = test::box({0, 0, 0}, {6.1, 3, 3}, 0.5, true);
    const auto slab = [&](const glm::dvec3& low, const glm::dvec3& high) {
        for (test::Placed& face : test::box(low, high, 0.5, false)) pieces.push_back(std::move(face));
    };
    slab({3.0, 0, 0}, {3.1, 1.4, 3}), slab({3.0, 1.5, 0}, {3.1, 3, 3});
    slab({3.0, 1.4, 0}, {3.1, 1.5, 1.4}), slab({3.0, 1.4, 1.5}, {3.1, 1.5, 3});
    for (test::Placed& piece : pieces) piece.material = test::matte(static_cast<double>(reflectance));
    return test::scene_of_pieces(std::move(pieces), {test::light_seed(test::isotropic(1.0), {1, 2, 1})});
}

// Every step of a solve over the links of real rooms: from a cold start the light stays between none and what energy
// allows, and each step shrinks the residual by the greatest reflectance at least. Rounding of half floats, 2^-11 of
// each value, is allowed for.
TEST(Transport, NoStepDiverges) {
    const struct {
        const char* what;
        bool narrow, exact, haze, rests;  // light on few surfels, which reversed links or VPLs find first
    } cases[] = {{"links", false, false, false, true},   {"reversed links", true, false, false, true},
                 {"VPLs", true, true, false, true},      {"haze", false, false, true, true},
                 {"moving", false, false, false, false}, {"moving, narrow", true, false, false, false}};
    for (const auto& [rho, hole] : {std::pair(0.5f, false), {0.95f, true}, {0.99f, false}}) {
        const Made made(hole ? keyhole(rho) : room({4, 3, 5}, rho, {1, 2, 1}), kFew);
        const std::size_t n = made.surfels().count;
        Pool pool;
        Links links = made.transport->links;
        const unsigned there = links.per_surfel();
        const auto set = trace_links(*made.geometry, made.surfels(), *made.transport->surface->cells, there,
                                     kReverseGenerations[0] - there, pool, [] { return false; });
        links.reversed.push_back(std::make_shared<const ReverseLinks>(reverse(*set, n)));
        for (const auto& one : cases) {
            SCOPED_TRACE(std::string(one.what) + ", " + std::to_string(rho));
            std::vector<glm::vec4> direct = made.irradiance.direct, exact, haze;
            std::vector<std::uint8_t> seen;
            for (std::size_t i = 0; i < n; ++i) {
                direct[i] *= glm::vec4(1.0f, 0.5f, 0.1f, 0.0f);
                if (one.narrow && i % 997 != 0) direct[i] = glm::vec4(0.0f);
                if (one.exact) exact.emplace_back(glm::vec3(static_cast<float>(i % 5)), 0.0f);
                if (one.haze) haze.emplace_back(0.1f, 0.2f, static_cast<float>(i % 3), 0.0f);
                if (!one.rests) seen.push_back(i % 3 == 0 ? 1 : 0);
            }
            Bounces bounces(made.surfels(), links, direct, exact, haze, {~0u, one.rests, seen}, pool);
            EXPECT_EQ(bounces.narrow() > 0.0f, one.narrow);
            const Bounce bounce = [&](std::span<const glm::vec4> from, std::vector<glm::vec4>& to) {
                bounces.bounce(from, to);
            };
            std::vector<glm::vec4> e;
            bounces.bounce({}, e);
            glm::vec4 most(0.0f);
            for (const glm::vec4& value : e) most = glm::max(most, value);
            const glm::vec3 bound = glm::vec3(most) / (1.0f - rho);
            FixedPoint iteration(e, bound, one.rests ? 2 : 0, pool);
            glm::vec3 last(std::numeric_limits<float>::infinity());
            for (int step = 0; step < 60; ++step) {
                const glm::vec3 residual = iteration.step(bounce).residual;
                for (int k = 0; k < 3; ++k) {
                    EXPECT_LE(residual[k], rho * last[k] + bound[k] / 2048.0f) << step << " " << k;
                    for (const glm::vec4& value : e) {
                        ASSERT_GE(value[k], 0.0f);
                        ASSERT_LE(value[k], bound[k] * (1.0f + 1.0f / 2048.0f));
                    }
                }
                last = residual;
            }
            if (one.rests) {
                EXPECT_LT(last.r, 1e-3f * bound.r);
            }
        }
    }
}

// Beside a bright housing the largest residual is down to the rounding of the tables long before light has found its
// way through a keyhole: the solve goes on.
TEST(Transport, ABrightPlaceDoesNotEndTheSolveOfDarkOnes) {
    const Made made(keyhole(0.95f), kFew);
    Pool pool;
    Irradiance light = made.irradiance;
    made.solve_to_the_end(light, pool);
    const double dim = made.mean(light.indirect);
    // A surfel that sends to itself and its neighbours, a million times as bright as the rest.
    std::size_t brightest = 0;
    for (std::size_t i = 0; i < light.direct.size(); ++i)
        if (light.direct[i].g > light.direct[brightest].g) brightest = i;
    Irradiance both = made.irradiance;
    both.direct[brightest] += glm::vec4(glm::vec3(1e4f * light.direct[brightest].g), 0.0f);
    made.solve_to_the_end(both, pool);
    EXPECT_GT(made.mean(both.indirect), dim);
    // The rounding of half floats is 2^-11 a bounce, and rho / (1 - rho) times that in all: 0.93 %.
    EXPECT_LT(both.solved.error, 0.02f) << both.solved.bounces << " bounces";
}

// The room behind a keyhole has surfels all over, though few walks get there.
TEST(Transport, ARoomBehindAKeyholeHasSurfels) {
    const Made made(keyhole(0.8f), kFew);
    const Surfels& s = made.surfels();
    double area = 0.0;
    for (std::size_t i = 0; i < s.count; ++i) {
        if (static_cast<double>(s.position(i).x) + made.geometry->origin().x > 3.0999)
            area += static_cast<double>(s.area_m2[i]);
    }
    EXPECT_NEAR(area, 54.0, 2.7) << "of the room behind";
}

// A difference of two lights is the difference of what each is alone.
TEST(Transport, ADifferenceIsSolvedInTwoParts) {
    const Made made(room({4, 3, 5}, 0.9f, {1, 2, 1}), kFew);
    Pool pool;
    Irradiance first = made.irradiance, second = made.irradiance, both = made.irradiance;
    for (std::size_t i = 0; i < first.direct.size(); ++i) {
        second.direct[i] = glm::vec4(glm::vec3(i % 7 == 0 ? 3.0f : 0.0f), 0.0f);
        both.direct[i] = first.direct[i] - second.direct[i];
    }
    made.solve_to_the_end(second, pool), made.solve_to_the_end(both, pool);
    const double mean = made.mean(first.indirect) + made.mean(second.indirect);
    bool negative = false;
    for (std::size_t i = 0; i < both.indirect.size(); ++i) {
        negative |= both.indirect[i].g < 0.0f;
        EXPECT_NEAR(static_cast<double>(both.indirect[i].g),
                    static_cast<double>(first.indirect[i].g - second.indirect[i].g), 0.005 * mean);
    }
    EXPECT_TRUE(negative);
}

// A call that may compute few bounces leaves the rest to the next one, which goes on; the end is the same.
TEST(Transport, ASolveAtRestGoesOnInTheNextCall) {
    const Made made(room({4, 3, 5}, 0.95f, {1, 2, 1}), kFew);
    Pool pool;
    Irradiance light = made.irradiance;
    Accuracy few = kAtRest;
    few.most = 5;
    unsigned calls = 0;
    do {
        solve(made.surfels(), made.transport->links, {}, {}, few, light, pool);
        EXPECT_NE(light.converged, light.resumes);
    } while (light.resumes && ++calls < 100);
    EXPECT_GT(calls, 1u);
    EXPECT_LE(light.solved.error, kAtRest.least);
    for (std::size_t i = 0; i < light.indirect.size(); ++i)
        ASSERT_NEAR(static_cast<double>(light.indirect[i].g / made.irradiance.indirect[i].g), 1.0, 0.004);
}

// Light that is not a number lights nothing, and the solve says so.
TEST(Transport, ANumberThatIsNoneDoesNotSpread) {
    const Made made(room({4, 3, 5}, 0.5f, {1, 2, 1}), kFew);
    Pool pool;
    for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        Irradiance light = made.irradiance;
        light.direct[10].r = bad;
        made.solve_to_the_end(light, pool);
        EXPECT_FALSE(std::isfinite(light.solved.error));
        for (const glm::vec4& value : light.indirect) ASSERT_EQ(value, glm::vec4(0.0f));
    }
    Irradiance faint = made.irradiance;  // 1 / the greatest value is infinite
    for (glm::vec4& value : faint.direct) value *= 1e-38f;
    made.solve_to_the_end(faint, pool);
    for (const glm::vec4& value : faint.indirect) ASSERT_TRUE(std::isfinite(value.g));
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
    Builder between(geometry, seeds, kFew, kGenerations[1] + 1, false, false);
    between.wait();
    EXPECT_EQ(between.newest()->links.per_surfel(), kGenerations[2]) << "the next generation, not a wait without end";
    Builder never(geometry, seeds, kFew, kMostForwardLinks, false, false);
    never.hold(true);
}

}  // namespace
}  // namespace gonio::transport
