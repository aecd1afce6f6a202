// The denoiser against what is known of its input: Gaussian noise of a given size, edges, and the path tracer's own
// converged picture.
#include "server/trace/denoise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <random>

#include "server/assets/assets.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "server/trace/reference.h"
#include "tests/scenes/scenes.h"

namespace gonio::trace {
namespace {

constexpr int kSide = 96;

// A wall square to the view, 2 m away, of reflectance 1/2; both halves of the samples show `light`.
DenoisePlanes wall(const std::function<float(int x, int y)>& light) {
    constexpr std::size_t count = std::size_t(kSide) * kSide;
    DenoisePlanes planes{kSide, kSide};
    planes.exact.assign(count, glm::vec3(0.0f));
    planes.albedo.assign(count, glm::vec3(0.5f));
    planes.normal.assign(count, {0, 0, 1});
    planes.inverse_depth.assign(count, 0.5f);
    planes.inverse_depth_variance.assign(count, 0.0f);
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x) planes.half[0].emplace_back(light(x, y));
    planes.half[1] = planes.half[0];
    return planes;
}

// Adds noise to the halves, such that their mean has this standard deviation.
void add_noise(DenoisePlanes& planes, float sigma) {
    std::mt19937 random(1);
    std::normal_distribution<float> normal(0.0f, sigma * std::sqrt(2.0f));
    for (auto& half : planes.half)
        for (glm::vec3& value : half) value += normal(random);
}

double green(const std::vector<glm::vec3>& picture, int x, int y) {
    return static_cast<double>(picture[static_cast<std::size_t>(y * kSide + x)].g);
}

double column_mean(const std::vector<glm::vec3>& picture, int x) {
    double sum = 0.0;
    for (int y = 0; y < kSide; ++y) sum += green(picture, x, y) / kSide;
    return sum;
}

TEST(Denoise, TakesOutGaussianNoiseAndKeepsTheMean) {
    const auto slope = [](int x, int) { return 90.0f + 0.1f * static_cast<float>(x); };
    DenoisePlanes planes = wall(slope);
    constexpr double sigma = 10.0;
    add_noise(planes, static_cast<float>(sigma));
    const Denoised denoised = denoise(planes);
    double squares = 0.0, mean = 0.0, expected = 0.0;
    for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
            const double value = green(denoised.radiance, x, y), truth = static_cast<double>(slope(x, y));
            squares += (value - truth) * (value - truth);
            mean += value, expected += truth;
        }
    }
    const double rms = std::sqrt(squares / (kSide * kSide));
    EXPECT_LE(rms, sigma / 3);
    EXPECT_NEAR(mean / expected, 1.0, 0.005);
    // What the halves leave is what is left, but for bias.
    EXPECT_NEAR(denoised.noise * mean / (kSide * kSide), rms, 0.5 * rms);
}

// Light on the left of an edge is a tenth of that on its right.
TEST(Denoise, NothingBleedsOverAnEdgeOfNormalsOrDepths) {
    const auto step = [](int x, int) { return x < kSide / 2 ? 10.0f : 100.0f; };
    for (const bool depth : {false, true}) {
        DenoisePlanes planes = wall(step);
        for (int y = 0; y < kSide; ++y) {
            for (int x = kSide / 2; x < kSide; ++x) {
                const auto at = static_cast<std::size_t>(y * kSide + x);
                if (depth) planes.inverse_depth[at] = 1.0f / 2.2f;
                if (!depth) planes.normal[at] = {std::sqrt(0.5f), 0, std::sqrt(0.5f)};
            }
        }
        add_noise(planes, 30.0f);
        DenoisePlanes dark = planes;  // the same noise without the step: what is left of it is no bleeding
        for (auto& half : dark.half)
            for (int i = 0; i < kSide * kSide; ++i)
                if (i % kSide >= kSide / 2) half[static_cast<std::size_t>(i)] -= 90.0f;
        const auto stepped = denoise(planes).radiance, level = denoise(dark).radiance;
        for (const int x : {kSide / 2 - 2, kSide / 2 - 1, kSide / 2, kSide / 2 + 1}) {
            const double expected = column_mean(level, x) + (x < kSide / 2 ? 0.0 : 90.0);
            EXPECT_NEAR(column_mean(stepped, x), expected, 0.01 * 90.0) << (depth ? "depth" : "normal") << " " << x;
        }
    }
}

// The same light on a checkerboard of reflectances: light is filtered over its edges, which stay.
TEST(Denoise, ReflectanceStaysSharp) {
    const auto dark = [](int x, int y) { return (x / 8 + y / 8) % 2 == 0; };
    DenoisePlanes planes = wall([&](int x, int y) { return dark(x, y) ? 10.0f : 80.0f; });
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x)
            planes.albedo[static_cast<std::size_t>(y * kSide + x)] = glm::vec3(dark(x, y) ? 0.1f : 0.8f);
    std::mt19937 random(1);
    std::normal_distribution<float> normal(1.0f, 0.1f);
    for (auto& half : planes.half)
        for (glm::vec3& value : half) value *= normal(random);
    const auto radiance = denoise(planes).radiance;
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x)
            EXPECT_NEAR(green(radiance, x, y) / (dark(x, y) ? 10.0 : 80.0), 1.0, 0.05) << x << " " << y;
}

TEST(Denoise, WithoutNoiseNothingChanges) {
    const auto texture = [](int x, int y) { return static_cast<float>((x * 7919 + y * 104729) % 97) + 1.0f; };
    const DenoisePlanes planes = wall(texture);
    const Denoised denoised = denoise(planes);
    EXPECT_EQ(denoised.noise, 0.0);
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x)
            EXPECT_NEAR(green(denoised.radiance, x, y) / static_cast<double>(texture(x, y)), 1.0, 1e-6);
    DenoisePlanes flat = wall([](int, int) { return 42.0f; });
    flat.exact.assign(flat.exact.size(), glm::vec3(7.0f));
    for (const glm::vec3& value : denoise(flat).radiance) EXPECT_NEAR(static_cast<double>(value.g), 49.0, 49e-6);
}

TEST(Denoise, PixelsWithoutSurfaceStayDarkAndAreNoNumbersOfNothing) {
    DenoisePlanes planes = wall([](int x, int) { return x < 10 ? 0.0f : 50.0f; });
    add_noise(planes, 10.0f);
    for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < 10; ++x) {
            const auto at = static_cast<std::size_t>(y * kSide + x);
            for (auto* plane : {&planes.half[0], &planes.half[1], &planes.albedo, &planes.normal})
                (*plane)[at] = glm::vec3(0.0f);
            planes.inverse_depth[at] = 0.0f;
        }
    }
    const auto radiance = denoise(planes).radiance;
    for (int y = 0; y < kSide; ++y) {
        EXPECT_EQ(green(radiance, 9, y), 0.0);
        EXPECT_NEAR(green(radiance, 12, y), 50.0, 20.0);
    }
}

// Root mean square of the difference of two pictures' green, relative to the mean of the first.
double difference(const std::vector<float>& truth, const std::function<float(std::size_t)>& other) {
    double squares = 0.0, mean = 0.0;
    for (std::size_t at = 0; at < truth.size() / 4; ++at) {
        const double off = static_cast<double>(other(at) - truth[at * 4 + 1]);
        squares += off * off, mean += static_cast<double>(truth[at * 4 + 1]);
    }
    return std::sqrt(squares * static_cast<double>(truth.size() / 4)) / mean;
}

TEST(Denoise, TracedCornellComesNearerToItsConvergedPicture) {
    // The edges of an opening would be most of the difference: of points.
    const Scene scene = scene_of(test::of_points(*make_cornell()));
    const auto world = make_world(scene);
    PictureRequest request{scene.camera, 64, 64};
    request.antialias = request.planes = true;
    Settings settings;
    settings.noise = 1e-9;
    settings.bounces = 2;
    const auto picture = [&](std::uint32_t passes, std::uint32_t seed) {
        settings.max_passes = passes;
        settings.seed = seed;
        auto traced = std::make_unique<Picture>(world, request, settings);
        while (!traced->refine(1.0).complete) {
        }
        return traced;
    };
    const std::vector<float> truth = picture(256, 2)->values();
    const auto rough = picture(8, 1);
    const std::vector<float> noisy = rough->values();
    const Denoised denoised = denoise(rough->planes());
    double sum = 0.0, kept = 0.0;
    for (std::size_t at = 0; at < denoised.radiance.size(); ++at) {
        sum += static_cast<double>(noisy[at * 4 + 1]), kept += static_cast<double>(denoised.radiance[at].g);
    }
    EXPECT_NEAR(kept / sum, 1.0, 0.005);
    const double before = difference(truth, [&](std::size_t at) { return noisy[at * 4 + 1]; });
    const double after = difference(truth, [&](std::size_t at) { return denoised.radiance[at].g; });
    std::printf("cornell, 8 samples: rms %.4f, denoised %.4f, halves %.4f\n", before, after, denoised.noise);
    EXPECT_LE(after, before / 1.8);
}

TEST(Denoise, OneSampleIsBothHalves) {
    const Scene scene = scene_of(make_cornell());
    PictureRequest request{scene.camera, 16, 16};
    request.planes = true;
    Settings settings;
    settings.max_passes = 1;
    Picture traced(make_world(scene), request, settings);
    traced.refine(0.0);
    const std::vector<float> values = traced.values();
    const Denoised denoised = denoise(traced.planes());
    for (std::size_t at = 0; at < denoised.radiance.size(); ++at)
        for (int k = 0; k < 3; ++k)
            EXPECT_NEAR(denoised.radiance[at][k], values[at * 4 + static_cast<std::size_t>(k)],
                        1e-4f * values[at * 4 + static_cast<std::size_t>(k)]);
}

}  // namespace
}  // namespace gonio::trace
