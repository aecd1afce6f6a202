// Where surfels are (server/transport/surfels.h), how large they are, and which way they face.
#include "server/transport/surfels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/assets/assets.h"
#include "server/scene/scene.h"
#include "server/trace/sampler.h"
#include "tests/scenes/random_room.h"
#include "tests/unit/light/made_transport.h"

namespace gonio::transport {
namespace {

using test::quad;

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

// Few walks meet the edges of a table top in a wide hall, which are in full light.
TEST(Transport, ThinEdgesInTheOpenHaveSurfels) {
    std::vector<test::Placed> pieces = test::box({-15, 0, -15}, {15, 6, 15}, 0.5, true);
    const std::vector<test::Placed> top = test::box({-0.8, 0.7, -0.4}, {0.8, 0.72, 0.4}, 0.5, false);
    pieces.insert(pieces.end(), top.begin(), top.end());
    for (test::Placed& piece : pieces) piece.material = test::matte(0.5);
    const Made made(test::scene_of_pieces(std::move(pieces), {test::light_seed(test::isotropic(1.0), {9, 5, 9})}));
    int found = 0, all = 0;
    for (double along = -0.95; along < 1.0; along += 0.1) {
        for (const double side : {-1.0, 1.0}) {
            const glm::vec3 x(side, 0, 0), z(0, 0, side);
            for (const auto& [at, normal] : {std::pair(glm::dvec3(0.8 * side, 0.71, 0.4 * along), x),
                                             std::pair(glm::dvec3(0.8 * along, 0.71, 0.4 * side), z)}) {
                ++all;
                const Surfels& s = made.surfels();
                if (s.visible_from(*made.geometry, {made.geometry->local(at), normal, normal}) != s.count) ++found;
            }
        }
    }
    EXPECT_EQ(found, all);
    double edges_m2 = 0.0;
    for (std::size_t i = 0; i < made.surfels().count; ++i) {
        const glm::dvec3 at = made.geometry->origin() + glm::dvec3(made.surfels().position(i));
        if (std::abs(made.surfels().normal(i).y) < 0.5f && std::abs(at.x) < 1.0 && std::abs(at.z) < 1.0)
            edges_m2 += static_cast<double>(made.surfels().area_m2[i]);
    }
    const double expected_m2 = 2 * (1.6 + 0.8) * 0.02;
    EXPECT_NEAR(edges_m2, expected_m2, 0.2 * expected_m2);
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
    double all_m2 = 0.0, met_m2 = 0.0;
    bool crowded = false;
    for (std::size_t i = 0; i < made.surfels().count; ++i) {
        if (std::abs(made.surfels().normal(i).x) < 0.9f ||
            std::abs(made.geometry->origin().x + static_cast<double>(made.surfels().position(i).x) - 0.5) > 1e-3)
            continue;
        all_m2 += static_cast<double>(made.surfels().area_m2[i]);
        met_m2 += static_cast<double>(made.transport->met_m2[i]);
        crowded |= made.surfels().crowded(i);
    }
    EXPECT_TRUE(crowded);
    EXPECT_NEAR(all_m2, 2 * 0.2, 0.05 * 2 * 0.2);
    EXPECT_NEAR(met_m2, 2 * 0.2, 0.05 * 2 * 0.2);
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
        if (from_m > 8.0f * s.radius_m) {
            EXPECT_EQ(s.spacing_m[i], s.radius_m);
        }
        // A disc of the luminaire's distance around its foot; evenly spaced surfels would be 0.03 / radius² in it.
        if (from_m < 0.1f * std::numbers::sqrt2_v<float>) ++close;
    }
    EXPECT_GT(static_cast<float>(close), 2.0f * 0.0314f * 0.55f / (s.radius_m * s.radius_m));
    EXPECT_GT(crowded, close);
    EXPECT_LT(crowded, s.count / 10);
}

// Two wide plates 1 m apart, and the lower one evenly lit: the upper one has rho E / (1 - rho²), the lower one rho
// times that. A luminaire 5 cm below the upper plate crowds surfels, of which few points say how large they are.
TEST(Transport, CrowdedSurfelsReceiveWhatIsSent) {
    constexpr double half = 50.0;
    constexpr float lux = 1000.0f, rho = 0.5f;
    const Made made(test::scene_with(
        {{quad({-half, 0, half}, {half, 0, half}, {half, 0, -half}, {-half, 0, -half}), glm::vec3(rho)},
         {quad({-half, 1, -half}, {half, 1, -half}, {half, 1, half}, {-half, 1, half}), glm::vec3(rho)}},
        test::isotropic(1.0), {0, 0.95, 0}));
    const Surfels& s = made.surfels();
    Irradiance lit;
    lit.direct.assign(s.count, glm::vec4(0.0f));
    for (std::size_t i = 0; i < s.count; ++i)
        if (s.normal(i).y > 0.0f) lit.direct[i] = glm::vec4(lux);
    Pool pool;
    made.solve_to_the_end(lit, pool);
    ASSERT_GT(s.all_crowded.size(), 300u);
    double sum = 0.0, squares = 0.0;
    for (const Surfels::Crowded& one : s.all_crowded) {
        const float expected = (s.normal(one.id).y > 0.0f ? rho * rho : rho) * lux / (1.0f - rho * rho);
        const double off = static_cast<double>(lit.indirect[one.id].g / expected - 1.0f);
        sum += off, squares += off * off;
    }
    const double count = static_cast<double>(s.all_crowded.size());
    EXPECT_LT(std::sqrt(squares / count), 0.02);
    EXPECT_NEAR(sum / count, 0.0, 0.005);
}

// Of each luminaire of a closed room all the flux arrives, 4 pi lm of 1 cd, if the surfels' areas are right. A housing
// and a lampshade pass through each other there, and cut small parts off the cells of surfels.
TEST(Transport, LinksMeetSurfelsAsOftenAsTheirAreaSays) {
    const Scene scene = test::random_room(79);
    const Made made(scene, {}, {&scene.camera.eye, 1});
    for (const Light& light : scene.lights) {
        const std::vector<glm::vec4> direct = made.direct_of(made.geometry->local(light.position));
        double flux_lm = 0.0;
        for (std::size_t i = 0; i < direct.size(); ++i)
            flux_lm += static_cast<double>(made.transport->met_m2[i] * direct[i].g);
        EXPECT_NEAR(flux_lm, 4.0 * std::numbers::pi, 0.01 * 4.0 * std::numbers::pi) << light.name;
    }
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

// A flat housing of sheet metal around a luminaire in a room, open below by a slit.
struct Housing {
    static constexpr glm::dvec3 kLow{2.0, 1.5, 2.0}, kHigh{2.4, 1.6, 2.3}, kMiddle{2.2, 1.55, 2.15};
    Made made;
    Housing() : made(scene()) {}
    static Scene scene() {
        std::vector<test::Placed> pieces = test::box({0, 0, 0}, {6, 3, 6}, 0.5, true);
        for (test::Placed& face : test::box(kLow, kHigh, 0.5, false)) {
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
        return test::scene_of_pieces(std::move(pieces), {test::light_seed(test::isotropic(1.0), kMiddle)});
    }
    // take(surfel, place from the middle, normal) for those on one side of the housing's sheets.
    template <typename Take>
    void each(bool inside, const Take& take) const {
        for (std::size_t i = 0; i < made.surfels().count; ++i) {
            const glm::dvec3 p = glm::dvec3(made.surfels().position(i)) + made.geometry->origin() - kMiddle,
                             n(made.surfels().geometric[i]);
            if (glm::all(glm::lessThan(glm::abs(p), 0.5 * (kHigh - kLow) + 1e-3)) && (glm::dot(n, p) < 0.0) == inside)
                take(i, p, n);
        }
    }
};

const Housing& the_housing() {
    static const Housing made;  // for several tests
    return made;
}

// Most of the light stays inside, where a sheet faces as the outside of the opposite one does. Both sides of all sheets
// have surfels.
TEST(Transport, TheOutsideOfAHousingHasSurfels) {
    const Housing& housing = the_housing();
    double outside_m2 = 0.0;
    housing.each(false, [&](std::size_t i, const glm::dvec3&, const glm::dvec3&) {
        outside_m2 += static_cast<double>(housing.made.surfels().area_m2[i]);
    });
    EXPECT_NEAR(outside_m2, 0.38 - 0.006, 0.1 * 0.38);
}

// Inside they are small, and as large together as the sheets. The lid has no light but what bounces there, so an area
// that is a few hundredths off makes all of it as much darker.
TEST(Transport, AreasInAHousing) {
    const Housing& housing = the_housing();
    double lid_m2 = 0.0, met_m2 = 0.0, walls_m2 = 0.0;
    int all = 0, crowded = 0;
    housing.each(true, [&](std::size_t i, const glm::dvec3&, const glm::dvec3& n) {
        all += 1, crowded += housing.made.surfels().crowded(i) ? 1 : 0;
        if (n.y < -0.9) lid_m2 += static_cast<double>(housing.made.surfels().area_m2[i]);
        if (n.y < -0.9) met_m2 += static_cast<double>(housing.made.transport->met_m2[i]);
        if (std::abs(n.y) < 0.1) walls_m2 += static_cast<double>(housing.made.surfels().area_m2[i]);
    });
    EXPECT_GT(crowded, 9 * all / 10) << all;
    EXPECT_NEAR(lid_m2, 0.4 * 0.3, 0.02 * 0.4 * 0.3);
    EXPECT_NEAR(met_m2, 0.4 * 0.3, 0.02 * 0.4 * 0.3);
    EXPECT_NEAR(walls_m2, 2 * 0.1 * (0.4 + 0.3), 0.04 * 2 * 0.1 * (0.4 + 0.3));
}

// A downlight of cos³: on the walls of its housing illuminance falls to nothing over the height of two surfels. The
// points of their cells have the walls' flux.
TEST(Transport, ASteepDownlightInAHousing) {
    const Housing& housing = the_housing();
    const Surfels& s = housing.made.surfels();
    const auto lux = [](const glm::dvec3& from_light, const glm::dvec3& n) {
        const double d2 = glm::dot(from_light, from_light), down = std::max(-from_light.y / std::sqrt(d2), 0.0);
        return std::pow(down, 3.0) * -glm::dot(from_light, n) / (d2 * std::sqrt(d2));
    };
    double by_points_lm = 0.0, by_centres_lm = 0.0, expected_lm = 0.0;
    housing.each(true, [&](std::size_t i, const glm::dvec3& p, const glm::dvec3& n) {
        if (std::abs(n.y) > 0.1) return;
        const double m2 = static_cast<double>(s.area_m2[i]);
        const auto one = std::find_if(s.all_crowded.begin(), s.all_crowded.end(),
                                      [&](const Surfels::Crowded& crowded) { return crowded.id == i; });
        ASSERT_NE(one, s.all_crowded.end());
        by_centres_lm += m2 * lux(p, n);
        for (std::size_t k = 0; k < kCellPoints; ++k) {
            const glm::dvec3 at = glm::dvec3(one->points.at[k]) + housing.made.geometry->origin() - Housing::kMiddle;
            by_points_lm += m2 * static_cast<double>(one->points.share[k]) * lux(at, n);
        }
    });
    constexpr int kSteps = 200;  // midpoints of each wall
    for (const auto& [away, width] : {std::pair(0.2, 0.3), std::pair(0.15, 0.4)})
        for (int u = 0; u < kSteps; ++u)
            for (int v = 0; v < kSteps; ++v) {
                const glm::dvec3 p(away, 0.1 * ((v + 0.5) / kSteps - 0.5), width * ((u + 0.5) / kSteps - 0.5));
                expected_lm += 2.0 * lux(p, {-1, 0, 0}) * 0.1 * width / (kSteps * kSteps);
            }
    std::printf("flux on the walls %.5f lm: by points %.5f, by centres %.5f\n", expected_lm, by_points_lm,
                by_centres_lm);
    EXPECT_NEAR(by_points_lm, expected_lm, 0.08 * expected_lm);
}

// A square of a thousand members, lit by 1 + 4 x: one place for each quarter, and their mean is that of the square.
TEST(CellPoints, AreOneForEachQuarter) {
    std::vector<CellMember> members;
    for (int i = 0; i < 32; ++i)
        for (int k = 0; k < 32; ++k) {
            const double x = (i + 0.5) / 32;
            members.push_back({{x, 2.0, (k + 0.5) / 32}, k < 16 ? 1.0 : 3.0, 1.0 + 4.0 * x});
        }
    const CellPoints points = cell_points(members, {9, 9, 9}, 1.0f);
    double lit = 0.0, share = 0.0, squares = 0.0;
    for (std::size_t k = 0; k < kCellPoints; ++k) {
        const double x = static_cast<double>(points.at[k].x), part = static_cast<double>(points.share[k]);
        EXPECT_NEAR(part, 0.25, 0.02);
        EXPECT_EQ(points.at[k].y, 2.0f);
        lit += part * (1.0 + 4.0 * x), share += part, squares += part * x * x;
    }
    EXPECT_NEAR(share, 1.0, 1e-6);
    EXPECT_NEAR(lit, 3.0, 0.1);
    EXPECT_NEAR(squares, 1.0 / 3.0, 0.03) << "1/4 by one place for the whole";
}

TEST(CellPoints, OfFewMembers) {
    const CellPoints none = cell_points({}, {1, 2, 3}, 0.1f);
    EXPECT_EQ(none.share, (std::array{1.0f, 0.0f, 0.0f, 0.0f}));
    EXPECT_EQ(none.at[0], glm::vec3(1, 2, 3));
    std::vector<CellMember> members = {{{0, 0, 0}, 1.0, 5.0}};
    EXPECT_EQ(cell_points(members, {9, 9, 9}, 0.1f).at[0], glm::vec3(0, 0, 0));
    for (int count = 2; count <= 6; ++count) {
        members.push_back({{static_cast<float>(count), 0, 0}, 1.0, 0.0});
        const CellPoints points = cell_points(members, {9, 9, 9}, 0.1f);
        float sum = 0.0f;
        for (std::size_t k = 0; k < kCellPoints; ++k) {
            sum += points.share[k];
            if (points.share[k] > 0.0f) {
                EXPECT_NE(points.at[k], glm::vec3(9, 9, 9)) << count;
            }
        }
        EXPECT_NEAR(sum, 1.0f, 1e-6f) << count;
    }
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

// A sphere of 1 m with a round port in a black hall of 30 m, where surfels lie 0.6 m apart. The luminaire in the
// hall lights the sphere through the port. Any two points of a sphere see each other with the same form factor, so that
// E = rho Phi / (A (1 - rho (1 - f))) everywhere, with Phi through the port and f the port's share of A.
TEST(Transport, ASmallRoomInAHallHasSurfelsOfItsOwn) {
    constexpr int kRings = 48, kOut = 10;
    constexpr double kRadius_m = 0.5, kAway_m = 7.0, kReflectance = 0.8;
    constexpr SurfelSettings kSome{.least = 1000, .most = 10'000};
    std::vector<test::Placed> pieces = test::box({-15, -1, -15}, {15, 9, 15}, 0.0, true);
    test::Placed sphere;
    sphere.mesh = test::inward_sphere(kRadius_m, kRings);
    sphere.mesh.indices.erase(sphere.mesh.indices.begin(), sphere.mesh.indices.begin() + kOut * 2 * kRings * 6);
    sphere.material = test::matte(kReflectance);
    pieces.push_back(sphere);
    const Made made(test::scene_of_pieces(std::move(pieces), {test::light_seed(test::isotropic(1.0), {0, kAway_m, 0})}),
                    kSome);
    const double angle = std::numbers::pi * kOut / kRings, f = 0.5 * (1.0 - std::cos(angle)),
                 far_m = kAway_m - kRadius_m * std::cos(angle),
                 flux_lm = 2.0 * std::numbers::pi * (1.0 - far_m / std::hypot(far_m, kRadius_m * std::sin(angle))),
                 all_m2 = 4.0 * std::numbers::pi * kRadius_m * kRadius_m,
                 expected = kReflectance * flux_lm / (all_m2 * (1.0 - kReflectance * (1.0 - f)));
    double sum = 0.0, inside_m2 = 0.0;
    const Surfels& s = made.surfels();
    for (std::size_t i = 0; i < s.count; ++i) {
        const glm::dvec3 at = made.geometry->origin() + glm::dvec3(s.position(i));
        if (glm::length(at) > 1.01 * kRadius_m || glm::dot(at, glm::dvec3(s.normal(i))) > 0.0) continue;
        sum += static_cast<double>(s.area_m2[i]) * static_cast<double>(made.irradiance.indirect[i].g);
        inside_m2 += static_cast<double>(s.area_m2[i]);
    }
    EXPECT_NEAR(inside_m2, (1.0 - f) * all_m2, 0.05 * all_m2);
    EXPECT_NEAR(sum / inside_m2, expected, 0.04 * expected) << "1.22 of it without";
    EXPECT_LT(static_cast<double>(s.count), 1.2 * static_cast<double>(kSome.most)) << "bounded";
}

// A luminaire in the gap of 16 mm between two strips of 30 m, among 200 others: cells as fine as surfels lie apart, on
// all of them, take terabytes. Links still end at the surfel next to where they meet a strip.
TEST(Transport, LongTrianglesAreAsFineAsShortOnes) {
    std::vector<test::Piece> pieces;
    for (int i = 0; i < 200; ++i) {
        const double y = 0.016 * i;
        pieces.push_back({quad({0, y, 30}, {0.2, y, 30}, {0.2, y, 0}, {0, y, 0}), glm::vec3(0.5f)});
    }
    const Made made(test::scene_with(pieces, test::isotropic(1.0), {0.1, 0.012, 12.0}), kFew);
    const Surfels& s = made.surfels();
    float crowded_m2 = 0.0f, met_m2 = 0.0f;
    for (const Surfels::Crowded& one : s.all_crowded) {
        crowded_m2 += s.area_m2[one.id], met_m2 += made.transport->met_m2[one.id];
        const glm::vec3 p = s.position(one.id);
        trace::HitPacket hits;
        std::uint16_t ids[trace::kPacket];
        const Fan fan = make_fan(p + s.geometric[one.id] * made.geometry->step_off(p), s.normal(one.id),
                                 s.geometric[one.id], fan_directions(77, 0));
        const unsigned found = follow(fan, *made.geometry, s, *made.transport->surface->cells, hits, ids);
        for (int k = 0; k < trace::kPacket; ++k) {
            if ((found >> k & 1u) == 0 || ids[k] == s.count) continue;
            EXPECT_LT(glm::distance(fan.rays.at(k, hits.distance[k]), s.position(ids[k])), 1.5f * s.radius_m);
        }
    }
    ASSERT_GT(s.all_crowded.size(), 30u);
    EXPECT_NEAR(met_m2 / crowded_m2, 1.0f, 0.1f);
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

}  // namespace
}  // namespace gonio::transport
