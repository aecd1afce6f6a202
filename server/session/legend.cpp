#include "server/session/legend.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "server/scene/false_color.h"
#include "server/scene/scene.h"
#include "server/session/bitmap_text.h"
#include "shaders/lib/as_cpp.h"

namespace gonio {
namespace {

constexpr Rgb8 kPaper = {20, 21, 23}, kInk = {236, 237, 238}, kFigurePaper = {255, 255, 255}, kFigureInk = {0, 0, 0};

struct Box {
    int x, y, wide, high;
    bool touches(const Box& other) const {
        return x < other.x + other.wide && other.x < x + wide && y < other.y + other.high && other.y < y + high;
    }
};

Rgb8 bytes_of(const glm::vec3& color) {
    const glm::vec3 rounded = glm::clamp(color, 0.0f, 1.0f) * 255.0f + 0.5f;
    return {static_cast<std::uint8_t>(rounded.x), static_cast<std::uint8_t>(rounded.y),
            static_cast<std::uint8_t>(rounded.z)};
}

std::vector<std::string> title_of(const Scene& scene, View view) {
    const bool difference = shows_difference(scene, view);
    const std::string unit = view == View::luminance ? "cd/m²" : "lx";
    const std::string quantity = difference ? "Difference" : view == View::luminance ? "Luminance" : "Illuminance";
    std::vector<std::string> lines = {quantity + ", " + unit};
    if (!scene.view_only.empty()) lines.push_back("of " + scene.view_only);
    if (difference) lines.push_back("from " + scene.view_compare);
    return lines;
}

struct Layout {
    int dot_px, line_px, bar_wide, bar_high;
    Box box;
};

// The bar, from its lower end at y: colours, ends that lie beyond, a line for each level, and figures.
void draw_bar(const Pixels& to, const Layout& l, int x, int y, const layouts::FalseColorBlock& block,
              const FalseScale& scale, const std::vector<double>& levels) {
    const auto value_at = [&](double t) {
        return scale.logarithmic ? scale.low * std::pow(scale.high / scale.low, t)
                                 : scale.low + (scale.high - scale.low) * t;
    };
    for (int i = 0; i < l.bar_high; ++i)
        fill_box(to, x, y - 1 - i, l.bar_wide, 1,
                 bytes_of(false_color(block, static_cast<float>(value_at((i + 0.5) / l.bar_high)))));
    const int end = l.line_px / 2 + l.dot_px;
    fill_box(to, x, y - l.bar_high - end, l.bar_wide, end, bytes_of(glm::vec3(block.over)));
    if (!(scale.low == 0.0 && !scale.logarithmic))
        fill_box(to, x, y, l.bar_wide, end, bytes_of(glm::vec3(block.under)));
    std::vector<int> taken;  // by figures
    const auto draw_figure = [&](double value, bool level) {
        const double t = scale.logarithmic ? std::log(value / scale.low) / std::log(scale.high / scale.low)
                                           : (value - scale.low) / (scale.high - scale.low);
        if (!(t >= -1e-6 && t <= 1.0 + 1e-6)) return;
        const int at = y - static_cast<int>(std::lround(t * l.bar_high));
        const bool bright = glsl::luminance(false_color(block, static_cast<float>(value))) > 0.5f;
        if (level) fill_box(to, x, at, l.bar_wide, l.dot_px, bright ? kFigureInk : kFigurePaper);
        if (std::ranges::any_of(taken, [&](int other) { return std::abs(at - other) < l.line_px; })) return;
        taken.push_back(at);
        fill_box(to, x + l.bar_wide, at, 2 * l.dot_px, l.dot_px, kInk);
        draw_text(to, x + l.bar_wide + 4 * l.dot_px, at - l.line_px / 2 + l.dot_px, l.dot_px, figure(value), kInk);
    };
    for (const double level : levels) draw_figure(level, true);
    const std::vector<double> ticks = ticks_of(scale);
    // Borders of steps are equally far apart: each second or third where they are many.
    const std::size_t each = scale.steps == 0 ? 1
                                              : 1 + (static_cast<std::size_t>(l.line_px) * scale.steps - 1) /
                                                        static_cast<std::size_t>(l.bar_high);
    for (std::size_t i = 0; i < ticks.size(); i += each) draw_figure(ticks[i], false);
}

// Side of a letter's dot in a picture of that size.
int dot_of(int width_px, int height_px) {
    return std::clamp(std::min(width_px, height_px) / 300, 1, 8);
}

std::vector<double> levels_of(const Scene& scene, View view) {
    const FalseColor& settings = false_color_of(scene, view);
    return settings.isolux ? isolux_levels(settings, shows_difference(scene, view)) : std::vector<double>();
}

// The paper that a figure stands on.
Box paper_of(const LineFigure& one, int dot_px) {
    const int wide = (letters(figure(one.value)) * kLetterWide + 1) * dot_px, high = (kLetterHigh + 1) * dot_px;
    return {one.x - wide / 2, one.y - high / 2, wide, high};
}

// taken: where none may be.
std::vector<LineFigure> figures_of(const CapturedPicture& picture, const std::vector<double>& levels,
                                   std::vector<Box> taken) {
    const int dot_px = dot_of(picture.width_px, picture.height_px), cell = 100 * dot_px, least = 10 * dot_px;
    struct Candidate {
        int pixels = 0, x = 0, y = 0, off = INT_MAX;
    };
    std::map<std::array<int, 3>, Candidate> found;  // by row, column, level
    for (int y = 0; y < picture.height_px; ++y) {
        const std::uint8_t* marks =
            &picture.rgba8[4 * static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width_px) + 3];
        for (int x = 0; x < picture.width_px; ++x) {
            const int level = marks[4 * x];
            if (level == 0 || static_cast<std::size_t>(level) > levels.size()) continue;
            Candidate& one = found[{y / cell, x / cell, level}];
            ++one.pixels;
            const int off = std::abs(x % cell - cell / 2) + std::abs(y % cell - cell / 2);
            if (off >= one.off) continue;
            one.off = off, one.x = x, one.y = y;
        }
    }
    std::vector<LineFigure> figures;
    for (const auto& [key, one] : found) {
        if (one.pixels < least || figures.size() == kMostFigures) continue;
        const LineFigure made{levels[static_cast<std::size_t>(key[2] - 1)], one.x, one.y};
        const Box box = paper_of(made, dot_px);
        const bool inside =
            box.x >= 0 && box.y >= 0 && box.x + box.wide <= picture.width_px && box.y + box.high <= picture.height_px;
        if (!inside || std::ranges::any_of(taken, [&](const Box& other) { return box.touches(other); })) continue;
        figures.push_back(made);
        taken.push_back(box);
    }
    return figures;
}

void draw_line_figures(const Pixels& to, int dot_px, const std::vector<LineFigure>& figures) {
    for (const LineFigure& one : figures) {
        const Box box = paper_of(one, dot_px);
        fill_box(to, box.x, box.y, box.wide, box.high, kFigurePaper);
        draw_text(to, box.x + dot_px, box.y + dot_px, dot_px, figure(one.value), kFigureInk);
    }
}

}  // namespace

std::vector<LineFigure> line_figures(const CapturedPicture& picture, const Scene& scene, View view) {
    return figures_of(picture, levels_of(scene, view), {});
}

void draw_legend(CapturedPicture& picture, const Scene& scene, View view) {
    const Pixels to{picture.rgba8, picture.width_px, picture.height_px};
    const FalseColor& settings = false_color_of(scene, view);
    const bool difference = shows_difference(scene, view);
    const FalseScale scale = scale_of(settings, difference);
    const layouts::FalseColorBlock block = color_block(settings, difference);
    Layout l{};
    l.dot_px = dot_of(to.width_px, to.height_px);
    l.line_px = (kLetterHigh + 2) * l.dot_px;
    l.bar_wide = 12 * l.dot_px;
    std::vector<std::string> title = title_of(scene, view);
    const bool marks = settings.below > 0.0 && !difference;
    const int margin = 4 * l.dot_px, around = l.line_px * (static_cast<int>(title.size()) + (marks ? 1 : 0) + 2);
    l.bar_high = std::min(110 * l.dot_px, to.height_px - around - 4 * margin);
    int wide = l.bar_wide + 7 * kLetterWide * l.dot_px;
    for (const std::string& line : title) wide = std::max(wide, letters(line) * kLetterWide * l.dot_px);
    wide = std::min(wide + 2 * margin, to.width_px - 2 * margin);
    l.box = {to.width_px - wide - margin, margin, wide, around + l.bar_high + 2 * margin};
    fill_box(to, l.box.x, l.box.y, l.box.wide, l.box.high, kPaper);
    const int x = l.box.x + margin;
    int y = l.box.y + margin;
    const auto fits = static_cast<std::size_t>((wide - 2 * margin) / (kLetterWide * l.dot_px));
    for (std::string& line : title) {
        if (line.size() > fits + 1) line = line.substr(0, fits - 2) + "..";
        draw_text(to, x, y, l.dot_px, line, kInk);
        y += l.line_px;
    }
    y += l.line_px + l.bar_high;
    layouts::FalseColorBlock plain = block;
    plain.marks = glm::vec4(0.0f);
    draw_bar(to, l, x, y, plain, scale, settings.isolux && !difference ? settings.levels : std::vector<double>());
    y += l.line_px;
    if (marks) {
        fill_box(to, x, y, l.bar_wide, kLetterHigh * l.dot_px, kBelowMark);
        draw_text(to, x + l.bar_wide + 4 * l.dot_px, y, l.dot_px, "< " + figure(settings.below), kInk);
    }
    const std::vector<LineFigure> figures = figures_of(picture, levels_of(scene, view), {l.box});
    for (std::size_t mark = 3; mark < picture.rgba8.size(); mark += 4) picture.rgba8[mark] = 255;
    draw_line_figures(to, l.dot_px, figures);
}

}  // namespace gonio
