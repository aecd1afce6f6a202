// What lighting makes of a profile: of webs that are finer than a picture shows, and at any size in bounded time.
#include "server/scene/light_tables.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "ies/web.h"
#include "tests/unit/angles.h"

namespace gonio {
namespace {

// law: candela at (v, h) in degrees.
std::shared_ptr<const Profile> profile_of(std::size_t n_v, std::size_t n_h,
                                          const std::function<double(double, double)>& law) {
    auto profile = std::make_shared<Profile>();
    profile->name = "fine";
    ies::PhotometricWeb& web = profile->photometry.web;
    const auto spread = [](std::vector<double>& angles, std::size_t n, double range_deg) {
        for (std::size_t i = 0; i < n; ++i)
            angles.push_back(range_deg * static_cast<double>(i) / static_cast<double>(n - 1) * kDegree);
    };
    spread(web.v_rad, n_v, 180);
    spread(web.h_rad, n_h, 360);
    for (const double h : web.h_rad)
        for (const double v : web.v_rad) web.candela.push_back(static_cast<float>(law(v / kDegree, h / kDegree)));
    profile->peak_cd = ies::peak_intensity(web).in(cd);
    profile->flux_lm = ies::total_flux(web).in(lm);
    return profile;
}

double smooth(double v, double h) {
    return 1000.0 * std::exp(-0.001 * v * v) * (1.2 + std::cos(2 * h * kDegree));
}

TEST(LightTables, AWebThatIsNotTooFineStaysAsItIs) {
    for (const auto& [n_v, n_h] : {std::pair<std::size_t, std::size_t>{181, 361}, {18001, 2}, {3, 7201}}) {
        const auto profile = profile_of(n_v, n_h, smooth);
        const ies::PhotometricWeb& web = profile->photometry.web;
        EXPECT_FALSE(ies::thinned(web, Angle::degrees(kLeastStepV_deg), Angle::degrees(kLeastStepH_deg)));
        EXPECT_EQ(tables_of(*profile).thinned, "");
    }
}

// Against the smooth law itself: what is left out is a mean over hundredths of a degree, and the flux stays.
TEST(LightTables, AFinerWebIsMeansOverWhatAPictureShows) {
    const auto profile = profile_of(60'001, 3, [](double v, double) { return smooth(v, 0); });
    const ies::PhotometricWeb thin =
        ies::thinned(profile->photometry.web, Angle::degrees(0.01), Angle::degrees(0.05)).value();
    EXPECT_LE(thin.v_rad.size(), 18'002u);
    EXPECT_GE(thin.v_rad.size(), 13'000u);
    EXPECT_EQ(thin.h_rad, profile->photometry.web.h_rad);
    EXPECT_NEAR(ies::total_flux(thin).in(lm), profile->flux_lm, 1e-6 * profile->flux_lm);
    for (const double v : {0.0, 3.3333, 17.123, 42.0, 90.0})
        EXPECT_NEAR(ies::intensity_at(thin, Angle::degrees(v), Angle::degrees(10)).in(cd), smooth(v, 0),
                    1e-3 * smooth(v, 0) + 1e-6)
            << v;
    EXPECT_NE(tables_of(*profile).thinned.find("60001 x 3"), std::string::npos) << tables_of(*profile).thinned;
}

TEST(LightTables, PlanesThatAreTooFineBecomeMeansAndStillMeetAt360) {
    const auto profile = profile_of(19, 30'001, smooth);
    const ies::PhotometricWeb thin =
        ies::thinned(profile->photometry.web, Angle::degrees(0.01), Angle::degrees(0.05)).value();
    EXPECT_LE(thin.h_rad.size(), 7'202u);
    EXPECT_DOUBLE_EQ(thin.h_rad.back(), 2 * std::numbers::pi);
    EXPECT_NEAR(ies::total_flux(thin).in(lm), profile->flux_lm, 1e-6 * profile->flux_lm);
    for (std::size_t v = 0; v < thin.v_rad.size(); ++v) EXPECT_EQ(thin.at(0, v), thin.at(thin.h_rad.size() - 1, v));
    for (const double h : {0.0, 33.3, 90.0, 200.0})
        EXPECT_NEAR(ies::intensity_at(thin, Angle::degrees(30), Angle::degrees(h)).in(cd), smooth(30, h), 1.0) << h;
}

// A beam of half a degree whose edge has no width: two angles a ten-thousandth of a degree apart.
TEST(LightTables, AnEdgeStaysAsSharpAsItIs) {
    ies::PhotometricWeb web;
    web.v_rad = {0.0, 0.5 * kDegree, 0.5001 * kDegree, std::numbers::pi};
    web.h_rad = {0.0, 2 * std::numbers::pi};
    for (int h = 0; h < 2; ++h) web.candela.insert(web.candela.end(), {100, 100, 0, 0});
    EXPECT_FALSE(ies::thinned(web, Angle::degrees(0.01), Angle::degrees(0.05)));
}

// Directions are dealt as the light goes: of a web on any grid the density times the total is the intensity.
TEST(LightTables, DirectionsFollowTheFinestWebs) {
    for (const auto& [n_v, n_h] : {std::pair<std::size_t, std::size_t>{100'001, 2}, {37, 25}}) {
        const auto profile = profile_of(n_v, n_h, [](double v, double) { return v < 60 ? 500.0 : 0.0; });
        const DirectionTable& directions = tables_of(*profile).directions;
        const double even = 1.0 / (2 * std::numbers::pi * (1 - std::cos(60 * kDegree)));
        double density = 0.0, beyond = 0.0;
        constexpr int kSide = 32;
        for (int i = 0; i < kSide * kSide; ++i) {
            const glm::dvec3 d = directions.draw(
                {(static_cast<float>(i % kSide) + 0.5f) / kSide, (static_cast<float>(i / kSide) + 0.5f) / kSide},
                density);
            EXPECT_NEAR(density, directions.density(d), 0.02 * density);
            if (-d.z < std::cos(65.5 * kDegree)) ++beyond;
        }
        EXPECT_EQ(beyond, 0.0);
        EXPECT_NEAR(directions.density(glm::normalize(glm::dvec3(0.2, 0.1, -1))), even, 0.15 * even);
        EXPECT_GT(static_cast<double>(directions.beam_cosine()), std::cos(66.5 * kDegree));
        EXPECT_LT(static_cast<double>(directions.beam_cosine()), std::cos(60 * kDegree));
    }
}

}  // namespace
}  // namespace gonio
