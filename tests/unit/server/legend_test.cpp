// The legend that captures have, read back from the picture.
#include "server/session/legend.h"

#include <gtest/gtest.h>

#include <set>

#include "protocol/schema/palette.h"
#include "server/scene/false_color.h"
#include "server/scene/scene.h"
#include "server/session/bitmap_text.h"

namespace gonio {
namespace {

constexpr std::uint8_t kGrey = 77;

CapturedPicture grey(int width_px, int height_px) {
    CapturedPicture picture;
    picture.width_px = width_px;
    picture.height_px = height_px;
    picture.rgba8.assign(4 * static_cast<std::size_t>(width_px * height_px), kGrey);
    for (std::size_t i = 3; i < picture.rgba8.size(); i += 4) picture.rgba8[i] = 255;
    return picture;
}

Rgb8 at(const CapturedPicture& picture, int x, int y) {
    const std::uint8_t* p = &picture.rgba8[4 * static_cast<std::size_t>(y * picture.width_px + x)];
    return {p[0], p[1], p[2]};
}

std::set<Rgb8> colors_of(const CapturedPicture& picture) {
    std::set<Rgb8> colors;
    for (int y = 0; y < picture.height_px; ++y)
        for (int x = 0; x < picture.width_px; ++x) colors.insert(at(picture, x, y));
    return colors;
}

TEST(BitmapText, LettersAreWhatTheyLookLike) {
    CapturedPicture picture = grey(30, 10);
    const Pixels to{picture.rgba8, picture.width_px, picture.height_px};
    draw_text(to, 1, 1, 1, "1T", {255, 255, 255});
    const char* rows[] = {
        "..#...#####", ".##...#.#.#", "..#.....#..", "..#.....#..", "..#.....#..", "..#.....#..", ".###....#..",
    };
    for (int y = 0; y < 7; ++y)
        for (int x = 0; x < 11; ++x) EXPECT_EQ(at(picture, 1 + x, 1 + y)[0] == 255, rows[y][x] == '#') << x << "," << y;
    EXPECT_EQ(letters("cd/m²"), 5);
    draw_text(to, 28, 8, 3, "W²?é\x01", {1, 2, 3});  // beyond the edge
    EXPECT_EQ(picture.rgba8.size(), 1200u);
}

// Every step's colour, what lies beyond and the threshold are in it; the rest of the picture stays.
TEST(Legend, HasEveryStep) {
    for (const auto& [width, height] : {std::pair(160, 160), std::pair(800, 600), std::pair(4096, 300)}) {
        CapturedPicture picture = grey(width, height);
        Scene scene;
        FalseColor& settings = scene.false_color[0];
        settings.palette = "viridis";
        settings.steps = 8;
        settings.below = 20.0;
        draw_legend(picture, scene, View::illuminance);
        const std::set<Rgb8> found = colors_of(picture);
        const Palette& viridis = *find_palette("viridis");
        for (int step = 0; step < 8; ++step) {
            const auto color = color_at(viridis, (static_cast<float>(step) + 0.5f) / 8.0f);
            EXPECT_TRUE(std::ranges::any_of(found, [&](const Rgb8& one) {
                return std::abs(static_cast<float>(one[0]) - color[0]) < 1.5f &&
                       std::abs(static_cast<float>(one[1]) - color[1]) < 1.5f &&
                       std::abs(static_cast<float>(one[2]) - color[2]) < 1.5f;
            })) << step;
        }
        for (const Rgb8& mark : {viridis.under, viridis.over, kBelowMark}) EXPECT_TRUE(found.contains(mark)) << width;
        int covered = 0;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) covered += at(picture, x, y) == Rgb8{kGrey, kGrey, kGrey} ? 0 : 1;
        EXPECT_LT(covered, width * height * 9 / 10);
        EXPECT_EQ(at(picture, 0, 0), (Rgb8{kGrey, kGrey, kGrey}));
        EXPECT_EQ(at(picture, 0, height - 1), (Rgb8{kGrey, kGrey, kGrey}));
    }
}

// A line that the picture marks gets its figure, and its mark goes.
TEST(Legend, LinesHaveFigures) {
    CapturedPicture picture = grey(400, 400);
    Scene scene;
    scene.false_color[0].isolux = true;
    scene.false_color[0].steps = 4;  // levels 10, 100, 1k
    for (int x = 0; x < 200; ++x) picture.rgba8[4 * static_cast<std::size_t>(300 * 400 + x) + 3] = 2;
    draw_legend(picture, scene, View::illuminance);
    for (std::size_t i = 3; i < picture.rgba8.size(); i += 4) ASSERT_EQ(picture.rgba8[i], 255);
    CapturedPicture expected = grey(400, 400);
    draw_text({expected.rgba8, 400, 400}, 0, 0, 1, "100", {0, 0, 0});
    // Somewhere on the line "100" stands, black on white.
    bool seen = false;
    for (int y = 290; y < 302 && !seen; ++y) {
        for (int x = 0; x < 180 && !seen; ++x) {
            bool same = true;
            for (int v = 0; v < 8 && same; ++v)
                for (int u = 0; u < 17 && same; ++u)
                    same = (at(picture, x + u, y + v) == Rgb8{0, 0, 0}) == (at(expected, u, v) == Rgb8{0, 0, 0});
            seen = same;
        }
    }
    EXPECT_TRUE(seen);
}

// Where they are told to be drawn by others: on the line, one in each part of the picture; the marks stay.
TEST(Legend, FiguresHavePlaces) {
    CapturedPicture picture = grey(400, 400);
    Scene scene;
    scene.false_color[0].isolux = true;
    scene.false_color[0].levels = {120.0, 300.0};
    for (int x = 0; x < 400; ++x) {
        picture.rgba8[4 * static_cast<std::size_t>(150 * 400 + x) + 3] = 1;
        if (x < 8) picture.rgba8[4 * static_cast<std::size_t>(350 * 400 + x) + 3] = 2;  // too short
    }
    const std::vector<LineFigure> figures = line_figures(picture, scene, View::illuminance);
    ASSERT_EQ(figures.size(), 4u) << "one each 100 pixels";
    for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_EQ(figures[i].value, 120.0);
        EXPECT_EQ(figures[i].y, 150);
        EXPECT_NEAR(figures[i].x, 50.0 + 100.0 * static_cast<double>(i), 1.0);
    }
    EXPECT_EQ(picture.rgba8[4 * (150 * 400) + 3], 1) << "still marked";
    scene.false_color[0].isolux = false;
    EXPECT_TRUE(line_figures(picture, scene, View::illuminance).empty());
}

// A level that was given is a line across the bar, at its place: half way up from 0 to 400 lx.
TEST(Legend, LevelsThatWereGivenAreLinesInIt) {
    Scene scene;
    FalseColor& settings = scene.false_color[0];
    settings.logarithmic = false;
    settings.range_low = 0.0;
    settings.range_high = 400.0;
    settings.palette = "viridis";
    settings.isolux = true;
    const auto drawn = [&] {
        CapturedPicture picture = grey(400, 400);
        draw_legend(picture, scene, View::illuminance);
        return picture;
    };
    const CapturedPicture plain = drawn();
    settings.levels = {200.0};
    const CapturedPicture with = drawn();
    std::set<int> rows;
    const auto middle = color_at(*find_palette("viridis"), 0.5f);
    for (int y = 0; y < 400; ++y) {
        for (int x = 0; x < 400; ++x) {
            const Rgb8 before = at(plain, x, y);
            const bool bar = std::abs(static_cast<float>(before[1]) - middle[1]) < 4.0f &&
                             std::abs(static_cast<float>(before[2]) - middle[2]) < 4.0f;
            if (bar && at(with, x, y) == Rgb8{255, 255, 255}) rows.insert(y);
        }
    }
    EXPECT_EQ(rows.size(), 1u) << "white on the dark middle of viridis";
}

}  // namespace
}  // namespace gonio
