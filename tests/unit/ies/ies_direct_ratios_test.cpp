// EULUMDAT's direct ratios against closed forms, the light on the working plane, and what makers' files say.
#include "ies/direct_ratios.h"

#include <gtest/gtest.h>

#include <cmath>

#include "ies/core/printed.h"
#include "ies/photometry_file.h"
#include "ies/synthetic.h"
#include "ies/writers.h"
#include "tests/shared_data.h"
#include "tests/unit/ies_test_support.h"

namespace gonio::ies {
namespace {

// The luminaires along a side, as direct_ratios.h defines them.
int across(double room_index) {
    return std::max(1, static_cast<int>(std::ceil(2.0 * room_index - 1e-9)));
}

// Where they hang, in heights from a wall.
double place(double room_index, int i) {
    return 2.0 * room_index * (i + 0.5) / across(room_index);
}

Photometry lambert() {
    test::Lm63Text text;
    text.counts = "181 1";
    text.v.clear();
    text.candela.clear();
    for (int v = 0; v <= 180; ++v) {
        text.v += printed("%g ", 0.5 * v);
        text.candela += printed("%.9g ", 100.0 * std::cos(0.5 * v * kPi / 180.0));
    }
    return *read_photometry(text.text());
}

// The part of a small Lambertian source's light that a parallel rectangle takes, whose corner is below it.
double corner_factor(double a, double b) {
    const double sa = std::sqrt(1.0 + a * a), sb = std::sqrt(1.0 + b * b);
    return (a / sa * std::atan(b / sa) + b / sb * std::atan(a / sb)) / (2.0 * kPi);
}

TEST(DirectRatios, OfALambertianLuminaireAreFormFactors) {
    const auto ratios = direct_ratios(lambert().web);
    for (std::size_t k = 0; k < ratios.size(); ++k) {
        const double side = 2.0 * kRoomIndices[k];
        const int n = across(kRoomIndices[k]);
        double sum = 0.0;
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j) {
                const double x = place(kRoomIndices[k], i), y = place(kRoomIndices[k], j);
                for (const double a : {x, side - x})
                    for (const double b : {y, side - y}) sum += corner_factor(a, b);
            }
        EXPECT_NEAR(ratios[k], sum / (n * n), 1e-3) << kRoomIndices[k];
        if (k > 0) {
            EXPECT_GT(ratios[k], ratios[k - 1]);
        }
    }
    EXPECT_NEAR(ratios.front(), 0.3, 0.05);
    EXPECT_NEAR(ratios.back(), 0.85, 0.05);
}

// The illuminance of the working plane by the inverse square, point by point, of a light that is the same nowhere.
TEST(DirectRatios, AreTheLightOnTheWorkingPlane) {
    for (const char* name : {"street", "linear", "bulb"}) {
        const Photometry photometry = *read_photometry(synthetic_lm63(name));
        const auto ratios = direct_ratios(photometry.web);
        const double total = total_flux(photometry.web).in(lm);
        for (const std::size_t k : {0u, 3u, 6u}) {
            const double side = 2.0 * kRoomIndices[k];
            const int n = across(kRoomIndices[k]);
            constexpr int kCells = 300;
            const double cell = side / kCells;
            double flux = 0.0;
            for (int row = 0; row < kCells; ++row)
                for (int column = 0; column < kCells; ++column)
                    for (int i = 0; i < n; ++i)
                        for (int j = 0; j < n; ++j) {
                            const double x = (column + 0.5) * cell - place(kRoomIndices[k], i),
                                         y = (row + 0.5) * cell - place(kRoomIndices[k], j);
                            const double square = x * x + y * y + 1.0, distance = std::sqrt(square);
                            const double candela =
                                intensity(photometry.web, {x / distance, y / distance, -1.0 / distance}).in(cd);
                            flux += candela / (distance * square) * cell * cell;
                        }
            EXPECT_NEAR(ratios[k], flux / (n * n) / total, 3e-3) << name << ", k " << kRoomIndices[k];
        }
    }
}

TEST(DirectRatios, OfALightThatGoesUpAreZero) {
    PhotometricWeb web;
    web.v_rad = {0.0, kPi / 2, kPi};
    web.h_rad = {0.0, 2.0 * kPi};
    web.candela = {0.0f, 0.0f, 100.0f, 0.0f, 0.0f, 100.0f};
    for (const double ratio : direct_ratios(web)) EXPECT_EQ(ratio, 0.0);
    web.candela.assign(6, 0.0f);
    for (const double ratio : direct_ratios(web)) EXPECT_EQ(ratio, 0.0) << "a dark one";
}

TEST(DirectRatios, AreWrittenWhereTheFileHadNone) {
    const auto written = read_photometry(write_eulumdat(lambert()));
    ASSERT_TRUE(written);
    const auto ratios = direct_ratios(lambert().web);
    for (std::size_t k = 0; k < ratios.size(); ++k)
        EXPECT_NEAR(written->eulumdat->direct_ratios[k], ratios[k], 1e-3) << kRoomIndices[k];
    Photometry given = *written;
    given.eulumdat->direct_ratios.fill(0.5);
    EXPECT_EQ(read_photometry(write_eulumdat(given))->eulumdat->direct_ratios, given.eulumdat->direct_ratios)
        << "the maker's own stay";
}

// Makers' tables rest on patterns that the files do not tell; ours lies within 0.06 of them on the mean over k.
TEST(DirectRatios, AreNearThoseOfMakers) {
    const auto folder = gonio::test::shared_data("photometry");
    if (!folder) GTEST_SKIP() << "no shared photometry corpus on this machine";
    int files = 0;
    for (const auto& entry : std::filesystem::directory_iterator(*folder / "ldt")) {
        const auto read = read_photometry(test::read_file(entry.path()));
        const std::string name = entry.path().filename().string();
        // Of the others the intensities are not those of the luminaire that the ratios are for.
        if (!read || !read->eulumdat || !name.starts_with("eulumdat-")) continue;
        const auto& said = read->eulumdat->direct_ratios;
        if (!(said[0] > 0.0)) continue;
        const auto ratios = direct_ratios(read->web);
        double difference = 0.0;
        for (std::size_t k = 0; k < said.size(); ++k) difference += std::abs(ratios[k] - said[k]) / 10.0;
        EXPECT_LT(difference, 0.06) << name;
        ++files;
    }
    EXPECT_GT(files, 2);
}

}  // namespace
}  // namespace gonio::ies
