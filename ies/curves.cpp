#include "ies/curves.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace gonio::ies {

namespace {

std::string number(double value) {
    std::array<char, 32> buffer{};
    const int length = std::snprintf(buffer.data(), buffer.size(), "%.6g", value);
    return {buffer.data(), static_cast<std::size_t>(length)};
}

std::string coordinate(double value) {
    std::array<char, 32> buffer{};
    const int length = std::snprintf(buffer.data(), buffer.size(), "%.1f", value);
    return {buffer.data(), static_cast<std::size_t>(length)};
}

std::string escaped(std::string_view text) {
    std::string result;
    for (const char c : text) {
        if (c == '&')
            result += "&amp;";
        else if (c == '<')
            result += "&lt;";
        else if (c == '>')
            result += "&gt;";
        else
            result += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
    return result;
}

// I along one of the two principal planes of the file (C0-C180 and C90-C270; Types A and B: the lines V = 0 and H = 0).
struct Curve {
    std::string name;               // "C0-C180", …
    std::vector<double> angle_deg;  // half degrees, -180..180; negative on the C180 (C270) side
    std::vector<double> candela;    // same count
};

std::vector<Curve> principal_curves(const Photometry& photometry) {
    constexpr int kSteps = 360;
    const bool type_c = photometry.web.goniometer == Goniometer::type_c;
    const double zero = type_c ? photometry.provenance.zero_plane_rad : 0.0;
    std::vector<Curve> curves(2);
    curves[0].name = type_c ? "C0-C180" : "V = 0";
    curves[1].name = type_c ? "C90-C270" : "H = 0";
    for (std::size_t plane = 0; plane < 2; ++plane) {
        // The line V = 0 runs along -y (H grows clockwise), the line H = 0 along +x.
        const double azimuth = type_c ? zero + static_cast<double>(plane) * kPi / 2 : plane == 0 ? -kPi / 2 : 0.0;
        for (int i = -kSteps; i <= kSteps; ++i) {
            const double t = 0.5 * i * kPi / 180.0;
            const Direction direction = {std::sin(t) * std::cos(azimuth), std::sin(t) * std::sin(azimuth),
                                         -std::cos(t)};
            curves[plane].angle_deg.push_back(0.5 * i);
            curves[plane].candela.push_back(intensity(photometry.web, direction).in(cd));
        }
    }
    return curves;
}

double largest(const std::vector<Curve>& curves) {
    double peak = 0.0;
    for (const Curve& curve : curves) {
        for (const double value : curve.candela) peak = std::max(peak, value);
    }
    return peak;
}

// A step of 1, 2 or 5 times a power of ten that divides the range in about `parts`.
double round_step(double range, double parts) {
    const double raw = range > 0.0 ? range / parts : 1.0;
    const double power = std::pow(10.0, std::floor(std::log10(raw)));
    for (const double factor : {1.0, 2.0, 5.0}) {
        if (raw <= factor * power * 1.0000001) return factor * power;
    }
    return 10.0 * power;
}

constexpr std::array<const char*, 2> kStroke = {"#c0392b", "#2471a3"};
constexpr std::array<const char*, 2> kDash = {"", " stroke-dasharray=\"6 4\""};

std::string line(double x0, double y0, double x1, double y1) {
    return "<line x1=\"" + coordinate(x0) + "\" y1=\"" + coordinate(y0) + "\" x2=\"" + coordinate(x1) + "\" y2=\"" +
           coordinate(y1) + "\" stroke=\"#ccc\"/>\n";
}

std::string label(double x, double y, const char* anchor, const std::string& text) {
    return "<text x=\"" + coordinate(x) + "\" y=\"" + coordinate(y) + "\" text-anchor=\"" + anchor + "\">" + text +
           "</text>\n";
}

template <typename ToPoint>
std::string polyline(const Curve& curve, std::size_t style, ToPoint to_point) {
    std::string points;
    for (std::size_t i = 0; i < curve.angle_deg.size(); ++i) {
        const auto [x, y] = to_point(curve.angle_deg[i], curve.candela[i]);
        points += coordinate(x) + "," + coordinate(y) + " ";
    }
    return "<polyline fill=\"none\" stroke=\"" + std::string(kStroke[style]) + "\" stroke-width=\"2\"" + kDash[style] +
           " points=\"" + points + "\"/>\n";
}

std::string polar_svg(const std::vector<Curve>& curves, double step, double full_scale) {
    constexpr double kX = 220.0;
    constexpr double kY = 245.0;
    constexpr double kRadius = 175.0;
    std::string svg;
    const int rings = static_cast<int>(std::lround(full_scale / step));
    for (int ring = 1; ring <= rings; ++ring) {
        const double r = kRadius * ring / rings;
        svg += "<circle cx=\"" + coordinate(kX) + "\" cy=\"" + coordinate(kY) + "\" r=\"" + coordinate(r) +
               "\" fill=\"none\" stroke=\"#ccc\"/>\n";
        svg += label(kX + 3, kY + r - 3, "start", number(step * ring));
    }
    for (int degrees = 0; degrees < 360; degrees += 30) {
        const double t = degrees * kPi / 180.0;
        svg += line(kX, kY, kX + kRadius * std::sin(t), kY + kRadius * std::cos(t));
        const int shown = degrees <= 180 ? degrees : 360 - degrees;
        svg += label(kX + (kRadius + 16) * std::sin(t), kY + (kRadius + 16) * std::cos(t) + 4, "middle",
                     std::to_string(shown) + "&#176;");
    }
    for (std::size_t i = 0; i < curves.size(); ++i) {
        svg += polyline(curves[i], i % 2, [&](double angle_deg, double candela) {
            const double t = angle_deg * kPi / 180.0;
            const double r = kRadius * candela / full_scale;
            return std::pair{kX + r * std::sin(t), kY + r * std::cos(t)};
        });
    }
    return svg;
}

std::string cartesian_svg(const std::vector<Curve>& curves, double step, double full_scale) {
    constexpr double kLeft = 520.0;
    constexpr double kRight = 895.0;
    constexpr double kTop = 70.0;
    constexpr double kBottom = 420.0;
    const auto x_of = [&](double angle_deg) { return std::lerp(kLeft, kRight, (angle_deg + 180.0) / 360.0); };
    const auto y_of = [&](double candela) { return std::lerp(kBottom, kTop, candela / full_scale); };
    std::string svg;
    for (int angle = -180; angle <= 180; angle += 60) {
        svg += line(x_of(angle), kTop, x_of(angle), kBottom);
        svg += label(x_of(angle), kBottom + 16, "middle", std::to_string(angle) + "&#176;");
    }
    for (int i = 0; i <= static_cast<int>(std::lround(full_scale / step)); ++i) {
        svg += line(kLeft, y_of(step * i), kRight, y_of(step * i));
        svg += label(kLeft - 6, y_of(step * i) + 4, "end", number(step * i));
    }
    for (std::size_t i = 0; i < curves.size(); ++i) {
        svg += polyline(curves[i], i % 2, [&](double angle_deg, double candela) {
            return std::pair{x_of(angle_deg), y_of(candela)};
        });
        const double y = 40.0 + 18.0 * static_cast<double>(i);
        svg += "<line x1=\"770\" x2=\"810\" y1=\"" + coordinate(y - 4) + "\" y2=\"" + coordinate(y - 4) +
               "\" stroke=\"" + kStroke[i % 2] + "\" stroke-width=\"2\"" + kDash[i % 2] + "/>\n";
        svg += label(818, y, "start", curves[i].name);
    }
    return svg;
}

// Dots of 2 x 4 per character (Unicode 3.0 Braille patterns, U+2800..U+28FF).
struct Canvas {
    int columns, rows;
    std::vector<unsigned char> cells;

    Canvas(int width, int height)
        : columns(width), rows(height), cells(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 0) {}

    void dot(double x, double y) {
        const int px = static_cast<int>(std::lround(x));
        const int py = static_cast<int>(std::lround(y));
        if (px < 0 || py < 0 || px >= 2 * columns || py >= 4 * rows) return;
        constexpr unsigned char kBit[4][2] = {{0x01, 0x08}, {0x02, 0x10}, {0x04, 0x20}, {0x40, 0x80}};
        cells[static_cast<std::size_t>(py / 4 * columns + px / 2)] |= kBit[py % 4][px % 2];
    }
    void line(double x0, double y0, double x1, double y1) {
        const int steps = std::max(1, static_cast<int>(std::ceil(std::max(std::abs(x1 - x0), std::abs(y1 - y0)))));
        for (int i = 0; i <= steps; ++i) {
            const double t = static_cast<double>(i) / steps;
            dot(std::lerp(x0, x1, t), std::lerp(y0, y1, t));
        }
    }
    std::string row(int index) const {
        std::string text;
        for (int column = 0; column < columns; ++column) {
            const unsigned bits = cells[static_cast<std::size_t>(index * columns + column)];
            text += '\xe2';
            text += static_cast<char>(0xa0 | bits >> 6);
            text += static_cast<char>(0x80 | (bits & 0x3f));
        }
        return text;
    }
};

template <typename ToPoint>
void draw(Canvas& canvas, const Curve& curve, bool dashed, ToPoint to_point) {
    for (std::size_t i = 1; i < curve.angle_deg.size(); ++i) {
        if (dashed && i / 8 % 2 == 1) continue;
        const auto [x0, y0] = to_point(curve.angle_deg[i - 1], curve.candela[i - 1]);
        const auto [x1, y1] = to_point(curve.angle_deg[i], curve.candela[i]);
        canvas.line(x0, y0, x1, y1);
    }
}

}  // namespace

std::string curves_svg(const Photometry& photometry, std::string_view title) {
    const std::vector<Curve> curves = principal_curves(photometry);
    const double step = round_step(largest(curves), 4.0);
    const double full_scale = step * std::max(1.0, std::ceil(largest(curves) / step - 1e-9));
    return "<rect width=\"" + std::to_string(kCurvesWidth) + "\" height=\"" + std::to_string(kCurvesHeight) +
           "\" fill=\"#fff\"/>\n<g font-family=\"sans-serif\" font-size=\"11\" fill=\"#333\">\n" +
           "<text x=\"20\" y=\"26\" font-size=\"15\">" + escaped(title) + "</text>\n" +
           label(20, 44, "start", "luminous intensity in cd") + polar_svg(curves, step, full_scale) +
           cartesian_svg(curves, step, full_scale) + "</g>\n";
}

std::string curves_text(const Photometry& photometry) {
    const std::vector<Curve> curves = principal_curves(photometry);
    const double peak = std::max(largest(curves), 1e-30);
    constexpr int kRows = 14;
    Canvas polar(28, kRows);
    const double radius = 2.0 * kRows - 1.0;
    const double centre_x = 28.0;
    const double centre_y = 2.0 * kRows;
    polar.line(centre_x - radius, centre_y, centre_x + radius, centre_y);
    polar.line(centre_x, centre_y - radius, centre_x, centre_y + radius);
    Canvas cartesian(44, kRows);
    const double base = 4.0 * kRows - 1.0;
    cartesian.line(0.0, base, 87.0, base);
    cartesian.line(44.0, 0.0, 44.0, base);
    for (std::size_t i = 0; i < curves.size(); ++i) {
        draw(polar, curves[i], i == 1, [&](double angle_deg, double candela) {
            const double t = angle_deg * kPi / 180.0;
            const double r = radius * candela / peak;
            return std::pair{centre_x + r * std::sin(t), centre_y + r * std::cos(t)};
        });
        draw(cartesian, curves[i], i == 1, [&](double angle_deg, double candela) {
            return std::pair{(angle_deg + 180.0) / 360.0 * 87.0, base * (1.0 - candela / peak)};
        });
    }
    std::string text = "polar, full scale " + number(largest(curves)) + " cd; solid " + curves[0].name + ", dashed " +
                       curves[1].name + "\n";
    for (int row = 0; row < kRows; ++row) text += polar.row(row) + "    " + cartesian.row(row) + "\n";
    text += std::string(32, ' ') + "-180" + std::string(18, ' ') + "0" + std::string(17, ' ') + "+180 deg\n";
    return text;
}

}  // namespace gonio::ies
