#include "tests/bench/plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

namespace gonio::bench {
namespace {

constexpr int kColumns = 3;
constexpr double kLeastWidth = 560;                      // for title and legend
constexpr double kPanelWidth = 330, kPanelHeight = 250;  // of the plot area, px
constexpr double kLeft = 62, kGapX = 46, kGapY = 58, kTop = 128, kBottom = 58;

// Okabe and Ito's colours, told apart with any colour vision; shapes differ too.
constexpr std::array<const char*, 6> kLight = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#8a6d00", "#555555"};
constexpr std::array<const char*, 6> kDark = {"#56b4e9", "#ff9248", "#2fd6a6", "#f0a3cc", "#f0e442", "#bbbbbb"};

std::string number(double x) {
    char text[32];
    std::snprintf(text, sizeof text, "%.1f", x);
    return text;
}

std::string tick_text(double x) {
    char text[32];
    if (x >= 1000.0)
        std::snprintf(text, sizeof text, "%d,%03d", static_cast<int>(x) / 1000, static_cast<int>(x) % 1000);
    else
        std::snprintf(text, sizeof text, "%.4g", x);
    return text;
}

std::string escaped(const std::string& text) {
    std::string out;
    for (char c : text) {
        if (c == '<')
            out += "&lt;";
        else if (c == '&')
            out += "&amp;";
        else
            out += c;
    }
    return out;
}

// A logarithmic axis from tick to tick (1, 2, 5 of each decade) around low..high, at least a decade long.
struct Axis {
    std::vector<double> ticks;

    Axis(double low, double high) {
        constexpr double kSlack = 1.0 + 1e-9;
        for (int k = 3 * static_cast<int>(std::floor(std::log10(low)) - 1);; ++k) {
            const int decade = k >= 0 ? k / 3 : -((2 - k) / 3);
            const double tick =
                std::array{1.0, 2.0, 5.0}[static_cast<std::size_t>(k - 3 * decade)] * std::pow(10.0, decade);
            if (tick <= low * kSlack) ticks.clear();  // the last one at or below the lowest value begins the axis
            ticks.push_back(tick);
            if (tick * kSlack >= high && tick * kSlack >= 10.0 * ticks.front() && tick > low) break;
        }
    }
    double share_of(double x) const {  // 0..1
        return std::log(x / ticks.front()) / std::log(ticks.back() / ticks.front());
    }
};

std::string text_at(double x, double y, const std::string& text, const char* style) {
    return "<text x=\"" + number(x) + "\" y=\"" + number(y) + "\" class=\"" + style + "\">" + escaped(text) +
           "</text>\n";
}

std::string line_at(double x0, double y0, double x1, double y1, const char* style) {
    return "<line x1=\"" + number(x0) + "\" y1=\"" + number(y0) + "\" x2=\"" + number(x1) + "\" y2=\"" + number(y1) +
           "\" class=\"" + style + "\"/>\n";
}

std::string marker(std::size_t series, double x, double y) {
    const std::string style = "\" class=\"s" + std::to_string(series) + "\"/>\n";
    switch (series % 3) {
        case 0:
            return "<circle cx=\"" + number(x) + "\" cy=\"" + number(y) + "\" r=\"4.2" + style;
        case 1:
            return "<rect x=\"" + number(x - 3.8) + "\" y=\"" + number(y - 3.8) + "\" width=\"7.6\" height=\"7.6" +
                   style;
        default:
            return "<path d=\"M" + number(x) + " " + number(y - 5) + "l4.8 8.4h-9.6z" + style;
    }
}

std::string style_sheet(std::size_t series) {
    const auto rules = [&](const std::array<const char*, 6>& colours, const char* ground, const char* ink,
                           const char* quiet, const char* grid) {
        std::string css = std::string(".ground{fill:") + ground + "}text{fill:" + ink + "}.quiet{fill:" + quiet +
                          "}.grid{stroke:" + grid + "}.frame{stroke:" + quiet + "}.front{stroke:" + ink + "}";
        for (std::size_t i = 0; i < series; ++i) {
            const std::string k = std::to_string(i);
            css += ".s" + k + "{fill:" + colours[i] + "}.l" + k + "{stroke:" + colours[i] + "}";
        }
        return css;
    };
    return "<style>text{font:12px system-ui,sans-serif}.title{font-size:17px;font-weight:600}.panel{font-weight:600}"
           ".right{text-anchor:end}.mid{text-anchor:middle}.small{font-size:10.5px}.tick{font-size:11px}"
           ".grid{stroke-width:1}.frame{fill:none}.curve{fill:none;stroke-width:1.5;stroke-dasharray:2 3}"
           ".front{fill:none;stroke-width:1.6;stroke-linejoin:round}" +
           rules(kLight, "#ffffff", "#1c1c1c", "#595959", "#e4e4e4") + "@media(prefers-color-scheme:dark){" +
           rules(kDark, "#16181c", "#ececec", "#a8a8a8", "#33373d") + "}</style>\n";
}

}  // namespace

std::string plot_svg(const Plot& plot) {
    const auto shown = [](const glm::dvec2& p) {
        return std::isfinite(p.x) && std::isfinite(p.y) && p.x > 0.0 && p.y > 0.0;
    };
    std::vector<std::string> names;
    glm::dvec2 low(std::numeric_limits<double>::infinity()), high(0.0);
    for (const PlotPanel& panel : plot.panels) {
        for (const PlotSeries& series : panel.series) {
            if (std::find(names.begin(), names.end(), series.name) == names.end()) names.push_back(series.name);
            for (const PlotPoint& point : series.points) {
                if (!shown(point.at)) continue;
                low = glm::min(low, point.at);
                high = glm::max(high, point.at);
            }
        }
    }
    if (!(high.x > 0.0)) low = high = glm::dvec2(1.0);
    names.resize(std::min<std::size_t>(names.size(), kLight.size()));
    const Axis axis_x(low.x, high.x), axis_y(low.y, high.y);
    const auto count = static_cast<int>(plot.panels.size());
    const int columns = std::clamp(count, 1, kColumns), rows = (std::max(count, 1) + columns - 1) / columns;
    const double width = kLeft + std::max(columns * (kPanelWidth + kGapX), kLeastWidth),
                 height = kTop + rows * (kPanelHeight + kGapY) + kBottom - kGapY;

    std::string svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + number(width) + " " +
                      number(height) + "\" width=\"" + number(width) + "\" height=\"" + number(height) +
                      "\" role=\"img\">\n<title>" + escaped(plot.title) + "</title>\n" + style_sheet(names.size()) +
                      "<rect class=\"ground\" width=\"100%\" height=\"100%\"/>\n";
    svg += text_at(kLeft, 28, plot.title, "title") + text_at(kLeft, 48, plot.subtitle, "quiet") +
           text_at(kLeft, 64, plot.note, "quiet");
    double legend = kLeft;
    for (std::size_t i = 0; i < names.size(); ++i) {
        svg += marker(i, legend + 5, 84) + text_at(legend + 15, 88, names[i], "");
        legend += 40 + 7.0 * static_cast<double>(names[i].size());
    }
    svg += line_at(legend, 84, legend + 24, 84, "front") + text_at(legend + 30, 88, plot.front_label, "");

    for (int p = 0; p < count; ++p) {
        const PlotPanel& panel = plot.panels[static_cast<std::size_t>(p)];
        const double x0 = kLeft + p % columns * (kPanelWidth + kGapX), y0 = kTop + p / columns * (kPanelHeight + kGapY);
        const bool lowest = p + columns >= count, first = p % columns == 0;
        const auto to_px = [&](const glm::dvec2& at) {
            return glm::dvec2(x0 + axis_x.share_of(at.x) * kPanelWidth,
                              y0 + (1.0 - axis_y.share_of(at.y)) * kPanelHeight);
        };
        svg += text_at(x0, y0 - 8, panel.title, "panel");
        double free_from = -1e9;  // where the last label ends
        for (double tick : axis_x.ticks) {
            const double x = to_px({tick, axis_y.ticks.front()}).x;
            svg += line_at(x, y0, x, y0 + kPanelHeight, "grid");
            const std::string text = tick_text(tick);
            const double half = 3.5 * static_cast<double>(text.size());
            if (x - half < free_from) continue;
            svg += text_at(x, y0 + kPanelHeight + 16, text, "tick quiet mid");
            free_from = x + half;
        }
        for (double tick : axis_y.ticks) {
            const double y = to_px({axis_x.ticks.front(), tick}).y;
            svg += line_at(x0, y, x0 + kPanelWidth, y, "grid");
            if (first) svg += text_at(x0 - 7, y + 4, tick_text(tick), "tick quiet right");
        }
        svg += "<rect class=\"frame\" x=\"" + number(x0) + "\" y=\"" + number(y0) + "\" width=\"" +
               number(kPanelWidth) + "\" height=\"" + number(kPanelHeight) + "\"/>\n";
        if (lowest) svg += text_at(x0 + kPanelWidth / 2, y0 + kPanelHeight + 36, plot.x_label, "mid");
        std::string front;
        for (const glm::dvec2& at : panel.front) {
            if (shown(at)) front += (front.empty() ? "M" : "L") + number(to_px(at).x) + " " + number(to_px(at).y);
        }
        if (!front.empty()) svg += "<path class=\"front\" d=\"" + front + "\"/>\n";
        for (const PlotSeries& series : panel.series) {
            const auto name = std::find(names.begin(), names.end(), series.name);
            if (name == names.end()) continue;
            const auto k = static_cast<std::size_t>(name - names.begin());
            std::string curve, marks;
            bool above = false;
            for (const PlotPoint& point : series.points) {
                if (!shown(point.at)) continue;
                const glm::dvec2 at = to_px(point.at);
                curve += (curve.empty() ? "M" : "L") + number(at.x) + " " + number(at.y);
                marks += marker(k, at.x, at.y);
                above = !above;  // neighbours on a curve are often close
                if (point.label.empty()) continue;
                const bool inside = at.x > x0 + kPanelWidth - 36;
                marks += text_at(at.x + (inside ? -8 : 8), at.y + (above ? -5 : 13), point.label,
                                 inside ? "small quiet right" : "small quiet");
            }
            if (!curve.empty())
                svg += "<path class=\"curve l" + std::to_string(k) + "\" d=\"" + curve + "\"/>\n" + marks;
        }
    }
    const double middle = kTop + (rows * (kPanelHeight + kGapY) - kGapY) / 2;
    svg += "<text class=\"mid\" transform=\"translate(16 " + number(middle) + ") rotate(-90)\">" +
           escaped(plot.y_label) + "</text>\n</svg>\n";
    return svg;
}

}  // namespace gonio::bench
