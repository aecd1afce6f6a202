// The transport (server/transport) against closed forms, and each way in which surfels are known to go wrong.
#include "server/transport/transport.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "server/assets/assets.h"
#include "server/trace/sampler.h"
#include "server/transport/fixed_point.h"
#include "tests/scenes/placed.h"
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
            const glm::vec3 p = s.lit_at(i), to = light - p;
            const float d2 = glm::dot(to, to), cosine = glm::dot(to, s.normal(i)) / std::sqrt(d2);
            if (cosine <= 0.0f || glm::dot(to, s.geometric[i]) <= 0.0f) continue;
            if (geometry->occluded(p + s.geometric[i] * (4.0f * geometry->step_off(p)), light)) continue;
            irradiance.direct[i] = glm::vec4(glm::vec3(cosine / d2), 0.0f);
        }
        Pool pool;
        solve_to_the_end(irradiance, pool);
    }
    void solve_to_the_end(Irradiance& lit, Pool& pool) const {
        do {
            solve(surfels(), transport->links, {}, {}, kAtRest, lit, pool);
        } while (lit.resumes);
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
        const Made made(room(size, rho, {0.4 * size.x, 0.6 * size.y, 0.3 * size.z}));
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
        test::scene_with({{test::inward_sphere(2.0, 64), glm::vec3(0.6f)}}, test::isotropic(1.0), {0.5, 0.3, 0.4}));
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
    // By reciprocity what one crowded surfel sends comes to all others, none of it lost.
    std::vector<double> received_m2(surfels.count, 0.0);
    for (std::size_t i = 0; i < surfels.count; ++i)
        made.transport->links.crowded->each(i, [&](std::size_t j, float form_factor) {
            received_m2[j] += static_cast<double>(form_factor * made.transport->met_m2[i]);
        });
    for (const Surfels::Crowded& one : surfels.all_crowded) {
        const double own_m2 = static_cast<double>(made.transport->met_m2[one.id]);
        EXPECT_NEAR(received_m2[one.id], own_m2, 0.1 * own_m2) << one.id;
    }
}

// A pane that stops a fifth of the light has a fifth of its area, on each side, also where small surfels are.
TEST(Transport, APaneHasTheAreaThatStopsLight) {
    std::vector<test::Placed> pieces = test::box({0, 0, 0}, {1, 1, 1}, 0.5, true);
    for (test::Placed& piece : pieces) piece.material = test::matte(0.5);
    test::Placed pane;
    pane.mesh = quad({0.5, 0, 0}, {0.5, 0, 1}, {0.5, 1, 1}, {0.5, 1, 0});
    pane.material = test::matte(0.9);
    pane.material.alpha_blend = true, pane.material.base_color.a = 0.2f;
    pieces.push_back(pane);
    const Made made(
        test::scene_of_pieces(std::move(pieces), {test::light_seed(test::isotropic(1.0), {0.46, 0.5, 0.5})}), kFew);
    double all_m2 = 0.0, crowded_m2 = 0.0, met_m2 = 0.0;
    for (std::size_t i = 0; i < made.surfels().count; ++i) {
        if (std::abs(made.surfels().normal(i).x) < 0.9f ||
            std::abs(made.geometry->origin().x + static_cast<double>(made.surfels().position(i).x) - 0.5) > 1e-3)
            continue;
        all_m2 += static_cast<double>(made.surfels().area_m2[i]);
        if (!made.surfels().crowded(i)) continue;
        crowded_m2 += static_cast<double>(made.surfels().area_m2[i]);
        met_m2 += static_cast<double>(made.transport->met_m2[i]);
    }
    EXPECT_NEAR(all_m2, 2 * 0.2, 0.05 * 2 * 0.2);
    EXPECT_NEAR(met_m2, crowded_m2, 0.06 * crowded_m2);
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
    const Made made(test::floor_scene(4.0, 0.8f, test::isotropic(1.0), {0, 1, 0}));
    const Surfels& s = made.surfels();
    ASSERT_GT(s.count, 1000u);
    for (std::size_t i = 0; i < s.count; ++i) {
        EXPECT_GT(s.geometric[i].y, 0.0f) << "walks meet its front alone";
        EXPECT_EQ(made.irradiance.indirect[i].g, 0.0f) << "a plane does not light itself";
    }
}

// Flux that lands on a surfel is divided by the area on which links meet it. Points drawn evenly over all faces say how
// large that is: each one's cell has a surfel.
TEST(Transport, LinksSayHowLargeASurfelIs) {
    const Made made(room({1.0, 1.0, 1.0}, 0.5f, {0.4, 0.5, 0.6}), kFew);
    const Surfels& s = made.surfels();
    const SceneAsset& asset = made.geometry->asset();
    constexpr int kPoints = 1 << 19;  // some 250 a surfel
    std::vector<double> cell_m2(s.count + 1, 0.0);
    const auto triangles = 2 * asset.instances.size();  // all of one size
    for (std::uint32_t i = 0; i < kPoints; ++i) {
        trace::Sample sample(11, i);
        const glm::vec2 which = sample.next(), where = sample.next();
        const auto triangle =
            std::min(static_cast<std::size_t>(which.x * static_cast<float>(triangles)), triangles - 1);
        const float root = std::sqrt(where.x);
        cell_m2[made.transport->surface->cells->surfel_at(static_cast<unsigned>(triangle / 2),
                                                          static_cast<unsigned>(triangle % 2), root * (1.0f - where.y),
                                                          root * where.y, true)] += 6.0 / kPoints;
    }
    double all_m2 = 0.0, squares = 0.0, before = 0.0;
    for (std::size_t i = 0; i < s.count; ++i) {
        const double met_m2 = static_cast<double>(made.transport->met_m2[i]);
        all_m2 += met_m2;
        squares += std::pow(met_m2 / cell_m2[i] - 1.0, 2.0);
        before += std::pow(static_cast<double>(s.area_m2[i]) / cell_m2[i] - 1.0, 2.0);
    }
    const double count = static_cast<double>(s.count);
    EXPECT_EQ(cell_m2[s.count], 0.0);
    EXPECT_NEAR(all_m2, 6.0, 0.01 * 6.0);
    EXPECT_LT(std::sqrt(squares / count), 0.12) << "512 links and 250 points: 8 %";
    EXPECT_GT(std::sqrt(before / count), 0.15) << "else the links are not needed";
}

// Illuminance changes over distances like that to the luminaire, and so do surfels lie near it.
TEST(Transport, SurfelsCrowdNearALuminaire) {
    const Made made(room({4.0, 3.0, 5.0}, 0.5f, {0.1, 1.0, 2.0}));
    const Surfels& s = made.surfels();
    std::size_t close = 0, crowded = 0;
    for (std::size_t i = 0; i < s.count; ++i) {
        const float from_m = glm::distance(s.position(i), made.light);
        EXPECT_LE(s.spacing_m[i], s.radius_m);
        if (s.spacing_m[i] < s.radius_m) ++crowded;
        if (from_m > 6.0f * s.radius_m) {
            EXPECT_EQ(s.spacing_m[i], s.radius_m);
        }
        // A disc of the luminaire's distance around its foot; evenly spaced surfels would be 0.03 / radius² in it.
        if (from_m < 0.1f * std::numbers::sqrt2_v<float>) ++close;
    }
    EXPECT_GT(static_cast<float>(close), 2.0f * 0.0314f * 0.55f / (s.radius_m * s.radius_m));
    EXPECT_GT(crowded, close);
    EXPECT_LT(crowded, s.count / 10);
}

// A luminaire that is mounted on the ceiling: all surfels together are as large as the room's surfaces.
TEST(Transport, AreasNearALuminaireOnASurface) {
    const Made made(room({1.0, 1.0, 1.0}, 0.5f, {0.5, 1.0, 0.5}), kFew);
    double all_m2 = 0.0, met_m2 = 0.0;
    for (std::size_t i = 0; i < made.surfels().count; ++i) {
        all_m2 += static_cast<double>(made.surfels().area_m2[i]);
        met_m2 += static_cast<double>(made.transport->met_m2[i]);
    }
    EXPECT_NEAR(all_m2, 6.0, 0.02 * 6.0);
    EXPECT_NEAR(met_m2, 6.0, 0.02 * 6.0);
}

// Surfels of all sizes in a shallow box around a luminaire: together they are as large as the box.
TEST(Transport, AreasWhereSurfelsChangeSize) {
    const Made made(room({0.4, 0.1, 0.3}, 0.5f, {0.2, 0.05, 0.15}), {.least = 200, .most = 200});
    double all_m2 = 0.0;
    for (const float area_m2 : made.surfels().area_m2) all_m2 += static_cast<double>(area_m2);
    EXPECT_NEAR(all_m2, 0.38, 0.03 * 0.38);
}

// On a wall 5 cm from a luminaire surfels grow with the distance from its foot. Those of a disc that has most of the
// small ones are as large as it.
TEST(Transport, AreasGrowWithSurfels) {
    const Made made(room({1.0, 1.0, 1.0}, 0.5f, {0.5, 0.5, 0.05}), kFew);
    const glm::vec3 foot = made.geometry->local({0.5, 0.5, 0.0});
    double disc_m2 = 0.0;
    for (std::size_t i = 0; i < made.surfels().count; ++i) {
        if (glm::distance(made.surfels().position(i), foot) < 0.2f)
            disc_m2 += static_cast<double>(made.surfels().area_m2[i]);
    }
    const double expected_m2 = std::numbers::pi * 0.2 * 0.2;
    EXPECT_NEAR(disc_m2, expected_m2, 0.06 * expected_m2) << "11 % too small where neighbours' areas are just averaged";
}

// A carpet that lies exactly on the floor: light meets either of the two, and their area counts once.
TEST(Transport, FacesThatCoincideCountOnce) {
    std::vector<test::Placed> pieces = test::box({0, 0, 0}, {1, 1, 1}, 0.5, true);
    test::Placed carpet;
    carpet.mesh = quad({0.05, 0, 0.95}, {0.95, 0, 0.95}, {0.95, 0, 0.05}, {0.05, 0, 0.05});
    pieces.push_back(carpet);
    for (test::Placed& piece : pieces) piece.material = test::matte(0.5);
    const Made made(test::scene_of_pieces(std::move(pieces), {test::light_seed(test::isotropic(1.0), {0.5, 0.6, 0.5})}),
                    kFew);
    double all_m2 = 0.0;
    for (const float area_m2 : made.surfels().area_m2) all_m2 += static_cast<double>(area_m2);
    EXPECT_NEAR(all_m2, 6.0, 0.02 * 6.0);
}

// A flat housing of sheet metal, open by a slit: most of the light stays inside, where a sheet faces as the outside of
// the opposite one does. Both sides of all sheets have surfels.
TEST(Transport, TheOutsideOfAHousingHasSurfels) {
    const glm::dvec3 low(2.0, 1.5, 2.0), high(2.4, 1.6, 2.3);
    std::vector<test::Placed> pieces = test::box({0, 0, 0}, {6, 3, 6}, 0.5, true);
    for (test::Placed& face : test::box(low, high, 0.5, false)) {
        const bool bottom = std::all_of(face.mesh.vertices.begin(), face.mesh.vertices.end(),
                                        [&](const Vertex& v) { return std::abs(v.position.y - 1.5f) < 1e-3f; });
        if (!bottom) pieces.push_back(std::move(face));
    }
    for (const auto& [from, to] : {std::pair(2.0, 2.19), std::pair(2.21, 2.4)}) {
        test::Placed half;
        half.mesh = quad({from, 1.5, 2.0}, {to, 1.5, 2.0}, {to, 1.5, 2.3}, {from, 1.5, 2.3});
        pieces.push_back(half);
    }
    for (test::Placed& piece : pieces) piece.material = test::matte(0.5);
    const Made made(
        test::scene_of_pieces(std::move(pieces), {test::light_seed(test::isotropic(1.0), {2.2, 1.55, 2.15})}));
    double outside_m2 = 0.0;
    for (std::size_t i = 0; i < made.surfels().count; ++i) {
        const glm::dvec3 p = glm::dvec3(made.surfels().position(i)) + made.geometry->origin(),
                         n(made.surfels().geometric[i]), middle = 0.5 * (low + high);
        const bool housing = glm::all(glm::lessThan(glm::abs(p - middle), 0.5 * (high - low) + 1e-3));
        if (housing && glm::dot(n, p - middle) > 0.0) outside_m2 += static_cast<double>(made.surfels().area_m2[i]);
    }
    EXPECT_NEAR(outside_m2, 0.38 - 0.006, 0.1 * 0.38);
}

// Nothing that light reaches: no surfels, and nothing is read of them.
TEST(Transport, NoSurfels) {
    const Made made(test::scene_with({{quad({-1, 0, -1}, {1, 0, -1}, {1, 0, 1}, {-1, 0, 1}), glm::vec3(0.5f)}},
                                     test::isotropic(1.0), {0, 0, 5}));
    EXPECT_EQ(made.surfels().count, 0u);
    EXPECT_TRUE(made.transport->met_m2.empty());
}

// However many luminaires there are, those near them are some 5 % more at most.
TEST(Transport, ManyLuminairesCrowdLess) {
    const Scene scene = room({10.0, 3.0, 10.0}, 0.5f, {5.0, 1.5, 5.0});
    const auto geometry = std::make_shared<const trace::Geometry>(scene.asset);
    std::vector<glm::vec3> few = {geometry->local({5.0, 1.5, 5.0})}, many = few;
    for (int i = 0; i < 400; ++i)
        many.push_back(geometry->local({0.25 + 0.5 * (i % 20), 2.95, 0.25 + 0.5 * static_cast<double>(i / 20)}));
    Pool pool;
    const auto go_on = [] { return false; };
    const std::size_t without = place_surfels(*geometry, few, few.size(), {}, pool, go_on).count,
                      with = place_surfels(*geometry, many, many.size(), {}, pool, go_on).count;
    EXPECT_LT(static_cast<double>(with), 1.08 * static_cast<double>(without));
    EXPECT_GT(static_cast<double>(with), 1.01 * static_cast<double>(without));
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
    for (const float rho : {0.5f, 0.95f}) {
        for (const bool hole : {false, true}) {
            const Made made(hole ? keyhole(rho) : room({4, 3, 5}, rho, {1, 2, 1}), kFew);
            Pool pool;
            Bounces bounces(made.surfels(), made.transport->links, made.irradiance.direct, {}, {}, {~0u, true, {}},
                            pool);
            const Bounce bounce = [&](std::span<const glm::vec4> from, std::vector<glm::vec4>& to) {
                bounces.bounce(from, to);
            };
            std::vector<glm::vec4> e, next;
            bounces.bounce({}, e);
            float most = 0.0f;
            for (const glm::vec4& value : e) most = std::max(most, value.g);
            const float bound = most / (1.0f - rho);
            FixedPoint iteration(e, glm::vec3(bound), 2, pool);
            float last = std::numeric_limits<float>::infinity();
            for (int step = 0; step < 60; ++step) {
                const float residual = iteration.step(bounce).residual.g;
                EXPECT_LE(residual, rho * last + bound / 2048.0f) << step;
                last = residual;
                for (const glm::vec4& value : e) {
                    ASSERT_GE(value.g, 0.0f);
                    ASSERT_LE(value.g, bound * (1.0f + 1.0f / 2048.0f));
                }
            }
            EXPECT_LT(last, 1e-3f * bound);
        }
    }
}

// The room behind a keyhole has surfels all over, though few walks get there.
TEST(Transport, ARoomBehindAKeyholeHasSurfels) {
    const Made made(keyhole(0.8f));
    const Surfels& s = made.surfels();
    double area = 0.0;
    for (std::size_t i = 0; i < s.count; ++i) {
        if (static_cast<double>(s.position(i).x) + made.geometry->origin().x > 3.0999)
            area += static_cast<double>(s.area_m2[i]);
    }
    EXPECT_NEAR(area, 54.0, 2.7) << "of the room behind";
}

// A luminaire in a housing of 0.2 m that hangs over a floor of 100 m: light reaches a millionth of all surfaces.
TEST(Transport, AHousingInALargeSceneHasSurfels) {
    std::vector<test::Placed> pieces = test::box({0, 2, 0}, {0.2, 2.2, 0.2}, 0.5, false);
    test::Placed floor;
    floor.mesh = quad({-50, 0, 50}, {50, 0, 50}, {50, 0, -50}, {-50, 0, -50});
    pieces.push_back(floor);
    for (test::Placed& piece : pieces) piece.material = test::matte(0.5);
    const Made made(
        test::scene_of_pieces(std::move(pieces), {test::light_seed(test::isotropic(1.0), {0.1, 2.1, 0.1})}));
    EXPECT_GT(made.surfels().count, 10'000u);
    const double area = 6 * 0.2 * 0.2, expected = 4 * std::numbers::pi * 0.5 / (area * 0.5);
    // Rays start some tenths of a millimetre off surfaces, as coordinates of 50 m ask for.
    EXPECT_NEAR(made.mean(made.irradiance.indirect), expected, 0.05 * expected);
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

// A normal map that tilts the whole floor by 30 degrees: surfels face where the map says.
TEST(Transport, SurfelsFaceAsNormalMapsSay) {
    Scene scene = test::floor_scene(4.0, 0.8f, test::isotropic(1.0), {0, 1, 0});
    auto asset = std::make_shared<SceneAsset>(*scene.asset);
    Image tilted;
    tilted.width_px = tilted.height_px = 1;
    tilted.rgba = {static_cast<std::uint8_t>(std::lround(127.5 + 127.5 * 0.5)), 128,
                   static_cast<std::uint8_t>(std::lround(127.5 + 127.5 * std::sqrt(0.75))), 255};
    tilted.linear = true;
    asset->images.push_back(tilted);
    for (Material& material : asset->materials) material.normal_image = 0;
    for (Mesh& mesh : asset->meshes) mesh.tangents.assign(mesh.vertices.size(), glm::vec4(1, 0, 0, 1));
    scene.asset = asset;
    const Made made(scene, kFew);
    const Surfels& s = made.surfels();
    ASSERT_TRUE(s.detailed);
    for (std::size_t i = 0; i < s.count; ++i) {
        EXPECT_NEAR(static_cast<double>(s.detailed_normal(i).x), 0.5, 0.01);
        EXPECT_NEAR(static_cast<double>(s.detailed_normal(i).y), std::sqrt(0.75), 0.01);
        EXPECT_EQ(s.normal(i), glm::vec3(0, 1, 0)) << "which is what neighbours are compared by";
    }
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
