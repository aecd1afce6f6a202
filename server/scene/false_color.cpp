#include "server/scene/false_color.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "protocol/schema/palette.h"
#include "protocol/schema/view.pb.h"
#include "server/scene/scene.h"
#include "shaders/lib/as_cpp.h"

namespace gonio {
namespace {

static_assert(kPaletteColors == GONIO_FALSE_COLORS && kMostSteps < kMostLevels && kMostGivenLevels < kMostLevels);

constexpr std::size_t kMostTicks = 13;

glm::vec4 color4(const std::array<float, 3>& rgb) {
    return {rgb[0] / 255.0f, rgb[1] / 255.0f, rgb[2] / 255.0f, 1.0f};
}
glm::vec4 color4(const Rgb8& rgb) {
    return color4(std::array{static_cast<float>(rgb[0]), static_cast<float>(rgb[1]), static_cast<float>(rgb[2])});
}

// mantissas: of the figures in each decade.
std::vector<double> decades(const FalseScale& scale, std::initializer_list<double> mantissas) {
    std::vector<double> ticks;
    for (int power = static_cast<int>(std::floor(std::log10(scale.low))); ticks.size() <= kMostLevels; ++power) {
        const double decade = std::pow(10.0, power);
        if (decade > scale.high * (1 + 1e-9)) break;
        for (const double mantissa : mantissas) {
            const double tick = mantissa * decade;
            if (tick >= scale.low * (1 - 1e-9) && tick <= scale.high * (1 + 1e-9)) ticks.push_back(tick);
        }
    }
    return ticks;
}

// Figures that are 1, 2 or 5 times a power of ten apart, ten intervals at most.
std::vector<double> round_figures(const FalseScale& scale) {
    const double least = (scale.high - scale.low) / 10.0, decade = std::pow(10.0, std::floor(std::log10(least)));
    double apart = 10.0 * decade;
    for (const double mantissa : {5.0, 2.0, 1.0})
        if (mantissa * decade >= least * (1 - 1e-9)) apart = mantissa * decade;
    std::vector<double> ticks;
    for (double i = std::ceil(scale.low / apart - 1e-6); i * apart <= scale.high + 1e-6 * apart; ++i)
        ticks.push_back(i * apart);
    return ticks;
}

std::vector<double> borders(const FalseScale& scale) {
    std::vector<double> ticks;
    for (unsigned i = 0; i <= scale.steps; ++i) {
        const double t = i / static_cast<double>(scale.steps);
        ticks.push_back(scale.logarithmic ? scale.low * std::pow(scale.high / scale.low, t)
                                          : scale.low + (scale.high - scale.low) * t);
    }
    return ticks;
}

}  // namespace

bool is_false_color(View view) {
    return view == View::illuminance || view == View::luminance;
}

const FalseColor& false_color_of(const Scene& scene, View view) {
    return scene.false_color[view == View::luminance ? 1 : 0];
}

bool shows_difference(const Scene& scene, View view) {
    return is_false_color(view) && scene.presets.contains(scene.view_compare);
}

bool shows_one_light(const Scene& scene, View view) {
    return is_false_color(view) && !scene.view_only.empty();
}

FalseScale scale_of(const FalseColor& settings, bool difference) {
    if (difference) return {-settings.compare_range, settings.compare_range, false, settings.steps};
    return {settings.range_low, settings.range_high, settings.logarithmic, settings.steps};
}

std::vector<double> ticks_of(const FalseScale& scale) {
    if (scale.steps > 0) return borders(scale);
    if (!scale.logarithmic) return round_figures(scale);
    std::vector<double> ticks = decades(scale, {1.0, 2.0, 5.0});
    if (ticks.size() > kMostTicks) ticks = decades(scale, {1.0});
    return ticks.size() > 1 ? ticks : round_figures(scale);
}

static std::vector<double> levels_of(const FalseScale& scale) {
    const bool by_decade = scale.logarithmic && scale.steps == 0;
    std::vector<double> levels = by_decade ? decades(scale, {1.0, 2.0, 5.0}) : ticks_of(scale);
    if (levels.size() >= kMostLevels) levels = decades(scale, {1.0});
    if (scale.steps > 0) {  // the ends are no borders between two steps
        levels.erase(levels.begin());
        levels.pop_back();
    }
    return levels;
}

std::vector<double> isolux_levels(const FalseColor& settings, bool difference) {
    std::vector<double> levels =
        difference || settings.levels.empty() ? levels_of(scale_of(settings, difference)) : settings.levels;
    if (settings.below > 0.0 && !difference) levels.push_back(settings.below);
    std::ranges::sort(levels);
    levels.erase(std::unique(levels.begin(), levels.end()), levels.end());
    return levels;
}

layouts::FalseColorBlock color_block(const FalseColor& settings, bool difference) {
    const Palette* named = find_palette(settings.palette);
    const Palette& palette = difference || named == nullptr ? difference_palette() : *named;
    const FalseScale scale = scale_of(settings, difference);
    layouts::FalseColorBlock block{};
    for (std::size_t i = 0; i < kPaletteColors; ++i)
        block.colors[i] = color4(color_at(palette, static_cast<float>(i) / (kPaletteColors - 1)));
    block.under = color4(palette.under);
    block.over = color4(palette.over);
    block.below_mark = color4(kBelowMark);
    block.range = glm::vec4(scale.low, scale.high, scale.logarithmic ? 1.0f : 0.0f, scale.steps);
    const std::vector<double> levels = settings.isolux ? isolux_levels(settings, difference) : std::vector<double>();
    block.marks = glm::vec4(difference ? 0.0 : settings.below, levels.size(), 0.0f, 0.0f);
    for (std::size_t i = 0; i < levels.size(); ++i)
        block.levels[i / 4][static_cast<int>(i % 4)] = static_cast<float>(levels[i]);
    return block;
}

glm::vec3 false_color(const layouts::FalseColorBlock& block, float value) {
    const float low = block.range.x, high = block.range.y;
    if (block.marks.x > 0.0f && value < block.marks.x) return glm::vec3(block.below_mark);
    if (value < low) return glm::vec3(block.under);
    if (value > high) return glm::vec3(block.over);
    const float t = glsl::stepped_position(glsl::scale_position(value, low, high, block.range.z), block.range.w);
    const float at = glm::clamp(t, 0.0f, 1.0f) * (GONIO_FALSE_COLORS - 1);
    const int first = std::min(static_cast<int>(at), GONIO_FALSE_COLORS - 2);
    return glm::vec3(glm::mix(block.colors[first], block.colors[first + 1], at - static_cast<float>(first)));
}

int levels_reached(const layouts::FalseColorBlock& block, float value) {
    int reached = 0;
    for (int i = 0; i < static_cast<int>(block.marks.y); ++i) reached += value >= block.levels[i / 4][i % 4] ? 1 : 0;
    return reached;
}

std::string figure(double value) {
    char text[32];
    const double size = std::abs(value);
    std::snprintf(text, sizeof text, "%.3g", size >= 1000 && size < 1e9 ? value / 1000 : value);
    return size >= 1000 && size < 1e9 ? std::string(text) + "k" : std::string(text);
}

void put_false_color(const FalseColor& settings, bool difference, v1::FalseColor& out) {
    out.set_range_low(settings.range_low);
    out.set_range_high(settings.range_high);
    out.set_range_auto(settings.range_auto);
    out.set_scale(settings.logarithmic ? "log" : "linear");
    out.set_steps(settings.steps);
    out.set_palette(settings.palette);
    out.set_isolux(settings.isolux);
    out.set_below(settings.below);
    out.mutable_levels()->Assign(settings.levels.begin(), settings.levels.end());
    out.set_compare_range(settings.compare_range);
    out.clear_ticks();
    for (const double tick : ticks_of(scale_of(settings, difference))) out.add_ticks(tick);
}

}  // namespace gonio
