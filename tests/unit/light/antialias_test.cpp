// Edges by subpixel reconstruction: coverage of a pixel by a surface is an area that is known.
#include "server/lighting/antialias.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <glm/gtc/packing.hpp>
#include <set>

#include "server/scene/eye.h"
#include "server/scene/scene.h"
#include "tests/scenes/scenes.h"

namespace gonio::lighting {
namespace {

TEST(Antialias, SamplesAreSpreadOverThePixel) {
    for (const unsigned n : {1u, 4u, 16u, 64u}) {
        std::set<int> columns, rows;
        for (unsigned i = 0; i < n; ++i) {
            const glm::vec2 at = sample_offset(i, n) + 0.5f;
            columns.insert(static_cast<int>(at.x * static_cast<float>(n)));
            rows.insert(static_cast<int>(at.y * static_cast<float>(n)));
        }
        EXPECT_EQ(columns.size(), n) << "one in each column of width 1/n";
        EXPECT_EQ(rows.size(), n);
    }
    EXPECT_EQ(sample_offset(0, 1), glm::vec2(0.0f));
}

// A surface that fills the half of the view below a slanted line, before nothing or before a wall behind it.
struct HalfPlane {
    static constexpr int kSide = 64;
    static constexpr double kSlope = 0.37, kOffset = 0.013;  // of the line y = kSlope x + kOffset, z = -1
    Pool pool;
    GBuffer gbuffer;
    Raster raster;
    Edges edges;

    explicit HalfPlane(bool wall, float albedo = 0.5f) {
        const auto line = [](double x) { return glm::dvec3(x, kSlope * x + kOffset, -1.0); };
        std::vector<test::Piece> pieces = {
            {test::quad(line(-9), {-9, -9, -1}, {9, -9, -1}, line(9)), glm::vec3(albedo)}};
        if (wall) pieces.push_back({test::quad({-9, 9, -2}, {-9, -9, -2}, {9, -9, -2}, {9, 9, -2}), glm::vec3(0.25f)});
        Scene scene = test::scene_with(pieces, test::isotropic(1.0), {0, 0, 0});
        scene.camera.eye = {0, 0, 0};
        scene.camera.target = {0, 0, -1};
        scene.camera.fov_rad = 2.0 * std::atan(0.5);
        const auto traced = trace::geometry_of(scene);
        const auto drawn = make_drawn(traced, true);
        const Eye eye = eye_of(scene.camera, kSide, kSide);
        look_through(eye, *traced, 0.01f, kSide, kSide, gbuffer);
        draw_gbuffer(drawn->clusters, drawn->material_table, false, gbuffer, raster, pool);
        EdgeSamples samples;
        while (!add_edge_sample(drawn->clusters, drawn->material_table, false, gbuffer, raster, 16, samples, pool)) {
        }
        edges = edges_of(16, samples, pool);
    }
    // Result: the share of a pixel, counted from the bottom left, below the line.
    static double area(int x, int y) {
        constexpr int kFine = 64;
        int below = 0;
        for (int i = 0; i < kFine * kFine; ++i) {
            const double u = (x + (i % kFine + 0.5) / kFine) / kSide - 0.5,
                         v = (y + (i / kFine + 0.5) / kFine) / kSide - 0.5;
            below += v < kSlope * u + kOffset ? 1 : 0;
        }
        return static_cast<double>(below) / (kFine * kFine);
    }
    // Result: what a pixel shows where the light of a pixel is `light` of it; background shows 0.
    template <typename Light>
    double shown(int x, int y, const Light& light) const {
        const auto own = [&](int px, int py) {
            const std::size_t at = static_cast<std::size_t>(py) * gbuffer.row_length + static_cast<std::size_t>(px);
            return gbuffer.depth[at] > 0.0f ? light(px, py) : 0.0;
        };
        const std::size_t at = static_cast<std::size_t>(y) * gbuffer.row_length + static_cast<std::size_t>(x);
        const double albedo = raster.nearest[at] == 0 ? 0.0 : gbuffer.depth[at] > 0.006f ? 0.5 : 0.25;
        const auto row = static_cast<std::size_t>(y);
        for (std::uint32_t p = edges.rows[row]; p < edges.rows[row + 1]; ++p) {
            const layouts::EdgePixel& pixel = edges.pixels[p];
            if (pixel.x != static_cast<std::uint32_t>(x)) continue;
            double sum = static_cast<double>(pixel.own) * albedo * own(x, y);
            for (std::uint32_t t = pixel.first_tap; t < pixel.first_tap + pixel.count; ++t) {
                const layouts::EdgeTap& tap = edges.taps[t];
                if (tap.x != GONIO_NO_PIXEL)
                    sum +=
                        static_cast<double>(tap.albedo_share.x) * own(static_cast<int>(tap.x), static_cast<int>(tap.y));
            }
            return sum;
        }
        return albedo * own(x, y);
    }
};

TEST(Antialias, APixelIsCoveredByItsArea) {
    const HalfPlane half(false);
    double squares = 0.0;
    int edges = 0;
    for (int y = 0; y < HalfPlane::kSide; ++y) {
        for (int x = 0; x < HalfPlane::kSide; ++x) {
            const double off = half.shown(x, y, [](int, int) { return 1.0; }) / 0.5 - HalfPlane::area(x, y);
            EXPECT_LT(std::abs(off), 2.0 / 16.0) << x << "," << y;
            squares += off * off;
            edges += HalfPlane::area(x, y) > 0.0 && HalfPlane::area(x, y) < 1.0 ? 1 : 0;
        }
    }
    EXPECT_GT(edges, 64);
    // Sixteen strata: well below the 0.29 of one sample.
    EXPECT_LT(std::sqrt(squares / edges), 0.04);
}

// Light of a surface comes from its own pixels, never from those of the other: each has its own here.
TEST(Antialias, ASampleTakesTheLightOfItsOwnSurface) {
    const HalfPlane half(true);
    const auto light = [&](int x, int y) {
        const std::size_t at = static_cast<std::size_t>(y) * half.gbuffer.row_length + static_cast<std::size_t>(x);
        return half.gbuffer.depth[at] > 0.006f ? 100.0 : 10.0;
    };
    for (int y = 1; y + 1 < HalfPlane::kSide; ++y) {
        for (int x = 1; x + 1 < HalfPlane::kSide; ++x) {
            const double near = HalfPlane::area(x, y), expected = near * 50.0 + (1.0 - near) * 2.5;
            EXPECT_NEAR(half.shown(x, y, light), expected, 47.5 * 2.0 / 16.0) << x << "," << y;
        }
    }
}

// A floor 1 m below an eye that looks level: pixel (x, y) sees it at (u, v), a pixel wide and 1/slope long.
struct PatternedFloor {
    static constexpr int kSide = 64, kTexels = 128;
    static constexpr double kPeriod = 0.5;  // metres
    bool checks;                            // else stripes that run away from the eye
    Pool pool;
    GBuffer gbuffer;
    Raster raster;
    Edges edges;

    bool is_white(double x, double z) const {
        const auto upper = [](double at) { return at / kPeriod - std::floor(at / kPeriod) >= 0.5; };
        return checks ? upper(x) != upper(z) : upper(x);
    }
    explicit PatternedFloor(bool has_checks) : checks(has_checks) {
        Mesh mesh = test::quad({-40, 0, 0}, {40, 0, 0}, {40, 0, -80}, {-40, 0, -80});
        for (Vertex& vertex : mesh.vertices)
            vertex.uv = glm::vec2(vertex.position.x, vertex.position.z) / static_cast<float>(kPeriod);
        Scene scene = test::scene_with({{mesh}}, test::isotropic(1.0), {0, 3, 0});
        auto asset = std::make_shared<SceneAsset>(*scene.asset);
        Image image{kTexels, kTexels, {}};
        for (int i = 0; i < kTexels * kTexels; ++i) {
            const bool white =
                is_white((i % kTexels + 0.5) / kTexels * kPeriod, (i / kTexels + 0.5) / kTexels * kPeriod);
            for (int k = 0; k < 4; ++k) image.rgba.push_back(white || k == 3 ? 255 : 0);
        }
        asset->images = {image};
        asset->materials[0].base_color_image = 0;
        asset->materials[0].wrap_s = asset->materials[0].wrap_t = Wrap::repeat;
        scene.asset = asset;
        scene.camera.eye = {0, 1, 0};
        scene.camera.target = {0, 1, -1};
        scene.camera.fov_rad = 2.0 * std::atan(0.5);
        const auto traced = trace::geometry_of(scene);
        const auto drawn = make_drawn(traced, true);
        look_through(eye_of(scene.camera, kSide, kSide), *traced, 0.01f, kSide, kSide, gbuffer);
        draw_gbuffer(drawn->clusters, drawn->material_table, false, gbuffer, raster, pool);
        EdgeSamples samples;
        while (!add_edge_sample(drawn->clusters, drawn->material_table, false, gbuffer, raster, 16, samples, pool)) {
        }
        edges = edges_of(16, samples, pool);
    }
    // Result: the white share of a pixel.
    double expected(int x, int y) const {
        constexpr int kFine = 64;
        int white = 0;
        for (int i = 0; i < kFine * kFine; ++i) {
            const double u = (x + (i % kFine + 0.5) / kFine) / kSide - 0.5,
                         v = (y + (i / kFine + 0.5) / kFine) / kSide - 0.5;
            white += is_white(-u / v, 1.0 / v) ? 1 : 0;
        }
        return static_cast<double>(white) / (kFine * kFine);
    }
    // Result: rms of the difference, of rows whose pixels are from 2 to 13 times as long as wide.
    double rms(const std::vector<std::uint16_t>& albedo) const {
        constexpr int kRows = 30;
        double squares = 0.0;
        for (int y = 0; y < kRows; ++y) {
            for (int x = 0; x < kSide; ++x) {
                const std::size_t at = static_cast<std::size_t>(y) * gbuffer.row_length + static_cast<std::size_t>(x);
                const double off = static_cast<double>(glm::unpackHalf1x16(albedo[4 * at])) - expected(x, y);
                squares += off * off;
            }
        }
        return std::sqrt(squares / (kRows * kSide));
    }
};

// Sixteen strata of black and white, and the width of their own filter.
TEST(Antialias, ATextureIsItsMeanOverThePixel) {
    for (const bool checks : {true, false}) {
        const PatternedFloor floor(checks);
        const double one = floor.rms(floor.raster.albedo), sixteen = floor.rms(floor.edges.albedo);
        std::printf("%s: rms of one sample %.3f, of sixteen %.3f\n", checks ? "checks" : "stripes", one, sixteen);
        EXPECT_LT(sixteen, 0.04);
        EXPECT_LT(sixteen, 0.4 * one);
    }
}

}  // namespace
}  // namespace gonio::lighting
