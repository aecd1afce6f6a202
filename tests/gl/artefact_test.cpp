// What an average over a picture hides and an eye does not: single bright spots, the pattern of interleaved sampling,
// soft blotches. Indirect light of the live picture at the default setting, against the path tracer.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>

#include "server/scene/scene.h"
#include "server/trace/sources.h"
#include "tests/gl/look_session.h"
#include "tests/gl/test_context.h"

namespace gonio::test {
namespace {

using Luminances = std::vector<double>;  // a value a pixel, lx

Luminances luminances(const std::vector<glm::vec3>& lx) {
    Luminances result;
    for (const glm::vec3& rgb : lx) result.push_back(trace::luminance(glm::dvec3(rgb)));
    return result;
}
Luminances part_of(const Luminances& whole, int width, const Window& window) {
    Luminances part;
    for (int y = window.bottom; y < window.bottom + window.height; ++y) {
        const auto from = whole.begin() + y * width + window.left;
        part.insert(part.end(), from, from + window.width);
    }
    return part;
}
double mean_of(const Traced& traced, const Luminances& light) {
    double sum = 0.0, count = 0.0;
    for (std::size_t i = 0; i < light.size(); ++i) sum += traced.hit[i] ? light[i] : 0.0, count += traced.hit[i];
    return sum / count;
}

// Result: the greatest ratio of the light at a pixel to the brightest of the truth within kReach pixels; both with a
// tenth of the window's mean added, so that the dark counts as little as it is seen.
constexpr int kReach = 5;
double brightest_spot(const Traced& traced, const Luminances& live) {
    const Luminances truth = luminances(traced.indirect_lx);
    const Window& window = traced.window;
    const double floor_lx = 0.1 * mean_of(traced, truth);
    double greatest = 0.0;
    for (int y = kReach; y < window.height - kReach; ++y) {
        for (int x = kReach; x < window.width - kReach; ++x) {
            double around_lx = 0.0;
            for (int v = y - kReach; v <= y + kReach; ++v)
                for (int u = x - kReach; u <= x + kReach; ++u) around_lx = std::max(around_lx, truth[traced.at(u, v)]);
            greatest = std::max(greatest, (live[traced.at(x, y)] + floor_lx) / (around_lx + floor_lx));
        }
    }
    return greatest;
}

// Tiles of 16 × 16 pixels in which the sampling pattern repeats, with all their neighbours on one plane that is evenly
// lit.
constexpr int kTile = 16;
struct Tile {
    int x, y;  // pixels in the window
};
std::vector<Tile> even_tiles(const Traced& traced) {
    const Luminances truth = luminances(traced.indirect_lx);
    const auto mean = [&](int left, int bottom) {
        double sum = 0.0;
        for (int y = bottom; y < bottom + kTile; ++y)
            for (int x = left; x < left + kTile; ++x) sum += truth[traced.at(x, y)];
        return sum / (kTile * kTile);
    };
    const auto is_even = [&](int left, int bottom) {
        const std::size_t middle = traced.at(left + kTile / 2, bottom + kTile / 2);
        for (int y = bottom - kTile; y < bottom + 2 * kTile; ++y) {
            for (int x = left - kTile; x < left + 2 * kTile; ++x) {
                const std::size_t at = traced.at(x, y);
                const glm::vec3 off = traced.position[at] - traced.position[middle];
                if (!traced.hit[at] || std::abs(glm::dot(off, traced.normal[middle])) > 1e-3f) return false;
            }
        }
        for (int y = bottom - kTile; y <= bottom + kTile; y += kTile)
            for (int x = left - kTile; x <= left + kTile; x += kTile)
                if (std::abs(mean(x, y) / mean(left, bottom) - 1.0) > 0.1) return false;
        return true;
    };
    std::vector<Tile> tiles;
    for (int y = kTile; y + 2 * kTile <= traced.window.height; y += kTile)
        for (int x = kTile; x + 2 * kTile <= traced.window.width; x += kTile)
            if (is_even(x, y)) tiles.push_back({x, y});
    return tiles;
}

// What repeats from tile to tile: the mean over tiles of the light relative to its surroundings, by place in the tile.
class Pattern {
public:
    void add(const Traced& traced, const Luminances& live) {
        for (const Tile& tile : even_tiles(traced)) {
            ++tiles_;
            for (int y = 0; y < kTile; ++y)
                for (int x = 0; x < kTile; ++x) {
                    const std::size_t at = traced.at(tile.x + x, tile.y + y);
                    sums_[static_cast<std::size_t>(y * kTile + x)] +=
                        live[at] / around(traced, live, tile.x + x, tile.y + y) - 1.0;
                }
        }
    }
    int tiles() const { return tiles_; }
    // Result: root mean square over the places of a cell of this side.
    double rms(int side) const {
        const auto rough = side == kTile ? without_curvature() : sums_;
        std::vector<double> cell(static_cast<std::size_t>(side * side));
        for (int y = 0; y < kTile; ++y)
            for (int x = 0; x < kTile; ++x)
                cell[static_cast<std::size_t>(y % side * side + x % side)] +=
                    rough[static_cast<std::size_t>(y * kTile + x)] / tiles_ * side * side / (kTile * kTile);
        double mean = 0.0, squares = 0.0;
        for (double value : cell) mean += value / static_cast<double>(cell.size());
        for (double value : cell) squares += (value - mean) * (value - mean) / static_cast<double>(cell.size());
        return std::sqrt(squares);
    }

private:
    // The sums less what light has that falls or rises over the whole floor: 1, x, y, xy and, over 16 pixels from -1
    // to 1, the second Legendre polynomials, all orthogonal. (A cell of 4 px does not see them.)
    std::array<double, kTile * kTile> without_curvature() const {
        std::array<double, kTile* kTile> rough = sums_;
        const auto centred = [](int i) { return (i - (kTile - 1) / 2.0) / (kTile / 2.0); };
        const auto second = [&](double u) { return u * u - (1.0 - 1.0 / (kTile * kTile)) / 3.0; };
        for (int term = 0; term < 6; ++term) {
            const auto value = [&](int i) {
                const double x = centred(i % kTile), y = centred(i / kTile);
                return std::array{1.0, x, y, x * y, second(x), second(y)}[static_cast<std::size_t>(term)];
            };
            double product = 0.0, square = 0.0;
            for (int i = 0; i < kTile * kTile; ++i)
                product += rough[static_cast<std::size_t>(i)] * value(i), square += value(i) * value(i);
            for (int i = 0; i < kTile * kTile; ++i) rough[static_cast<std::size_t>(i)] -= product / square * value(i);
        }
        return rough;
    }
    // A mean over 17 × 17 pixels, the outermost counting half: blind to the tile's period and to slopes.
    static double around(const Traced& traced, const Luminances& live, int x, int y) {
        double sum = 0.0;
        for (int v = -kTile / 2; v <= kTile / 2; ++v)
            for (int u = -kTile / 2; u <= kTile / 2; ++u)
                sum += live[traced.at(x + u, y + v)] * (std::abs(u) == kTile / 2 ? 0.5 : 1.0) *
                       (std::abs(v) == kTile / 2 ? 0.5 : 1.0);
        return sum / (kTile * kTile);
    }

    std::array<double, kTile * kTile> sums_{};
    int tiles_ = 0;
};

// The mean of even tiles relative to the truth's.
struct Blotches {
    double rms = 0.0, most = 0.0;
    int tiles = 0;
};
Blotches blotches_of(const std::vector<Traced>& truth, const Luminances& live, int width) {
    Blotches found;
    for (const Traced& traced : truth) {
        const Luminances shown = part_of(live, width, traced.window), right = luminances(traced.indirect_lx);
        for (const Tile& tile : even_tiles(traced)) {
            double is = 0.0, should = 0.0;
            for (int y = tile.y; y < tile.y + kTile; ++y)
                for (int x = tile.x; x < tile.x + kTile; ++x)
                    is += shown[traced.at(x, y)], should += right[traced.at(x, y)];
            found.rms += (is / should - 1.0) * (is / should - 1.0);
            found.most = std::max(found.most, std::abs(is / should - 1.0));
            ++found.tiles;
        }
    }
    found.rms = std::sqrt(found.rms / found.tiles);
    return found;
}

// While luminaire and camera glide about the place that the truth is of: by 4 cm, and by less than kReach pixels.
TEST_P(Look, NoFireflies) {
    const auto brightest = [&](const Scene& scene) {
        const Luminances light = luminances(session.live_lx(scene));
        double greatest = 0.0;
        for (const Traced& traced : truth)
            greatest = std::max(greatest, brightest_spot(traced, part_of(light, scene.width_px, traced.window)));
        return greatest;
    };
    constexpr double kBound = 1.8;
    double greatest = 0.0;
    struct Move {
        double camera_rad, luminaire_m;
    };
    for (const Move move : {Move{0, 0}, {-0.002, 0}, {0.002, 0}, {0, -0.04}, {0, 0.04}, {0.001, 0.02}}) {
        const double here = brightest(session.moved(move.camera_rad, move.luminaire_m));
        EXPECT_LT(here, kBound) << "camera " << move.camera_rad << " rad, luminaire " << move.luminaire_m << " m";
        greatest = std::max(greatest, here);
    }
    // A point of the grid that shows two and a half times what it should, where it is brightest.
    Luminances spot = luminances(session.live_lx(session.home));
    Luminances part = part_of(spot, session.home.width_px, truth[0].window);
    const Window& window = truth[0].window;
    std::size_t brightest_at = truth[0].at(window.width / 2, window.height / 2);
    for (int y = kReach; y < window.height - kReach; ++y)
        for (int x = kReach; x < window.width - kReach; ++x)
            if (part[truth[0].at(x, y)] > part[brightest_at]) brightest_at = truth[0].at(x, y);
    part[brightest_at] *= 2.5;
    EXPECT_GT(brightest_spot(truth[0], part), kBound);
    // Unbounded kernels have them.
    Scene seed = session.home;
    seed.technique = Technique::seed;
    seed.samples = 64;
    const double of_seed = brightest(seed);
    std::printf("%s: brightest spot %.2f times the truth around it; seed technique %.2f\n", GetParam(), greatest,
                of_seed);
    EXPECT_GT(of_seed, kBound);
}

TEST_P(Look, NoPatternOfInterleavedSampling) {
    Pattern pattern, spoiled;
    for (int n = 0; n < 4; ++n) {
        const Luminances light = luminances(session.live_lx(session.moved(0.0, 0.04 * n)));
        for (const Traced& traced : truth) {
            Luminances part = part_of(light, session.home.width_px, traced.window);
            pattern.add(traced, part);
            // As a subset of VPLs with half a percent too much or too little light at every other grid point would
            // show, and a grid whose points stand out by a fifth of a percent.
            for (int y = 0; y < traced.window.height; ++y)
                for (int x = 0; x < traced.window.width; ++x)
                    part[traced.at(x, y)] *= ((x / 4 + y / 4) % 2 == 0 ? 1.005 : 0.995) * (x % 4 == 0 ? 1.002 : 1.0);
            spoiled.add(traced, part);
        }
    }
    std::printf("%s: pattern of 16 px %.3f %%, of 4 px %.3f %%, %d tiles; spoiled %.3f, %.3f %%\n", GetParam(),
                100 * pattern.rms(kTile), 100 * pattern.rms(4), pattern.tiles(), 100 * spoiled.rms(kTile),
                100 * spoiled.rms(4));
    EXPECT_GE(pattern.tiles(), 40);
    EXPECT_LT(pattern.rms(kTile), 0.003);
    EXPECT_GT(spoiled.rms(kTile), 0.003);
    EXPECT_LT(pattern.rms(4), 0.0005);
    EXPECT_GT(spoiled.rms(4), 0.0005);
}

TEST_P(Look, NoBlotches) {
    const Blotches shown = blotches_of(truth, luminances(session.live_lx(session.home)), session.home.width_px);
    std::printf("%s: tiles off by %.2f %% rms, %.2f %% at most, of %d\n", GetParam(), 100 * shown.rms, 100 * shown.most,
                shown.tiles);
    EXPECT_GE(shown.tiles, 10);
    const bool fine = GetParam() == std::string("cornell");  // in atrium leaves stand before the floor
    const double rms = fine ? 0.025 : 0.045, most = fine ? 0.05 : 0.08;
    EXPECT_LT(shown.rms, rms);
    EXPECT_LT(shown.most, most);
}

}  // namespace
}  // namespace gonio::test
