#include "server/session/grid_plan.h"

#include <algorithm>
#include <cmath>

#include "ies/core/printed.h"
#include "protocol/schema/grid.pb.h"
#include "server/scene/vector_field.h"

namespace gonio {
namespace {

constexpr double kWide = 900.0;  // of the rectangle on the plan, units; or kHigh, what fits
constexpr double kHigh = 900.0;
constexpr double kBorder = 46.0;  // around it
constexpr double kMostText = 26.0, kLeastText = 3.0;

std::string value_text(double lx) {
    return printed(lx < 9.95 ? "%.1f" : "%.0f", lx);
}

// The rectangle on the plan: u to the right, v up.
struct Plan {
    glm::dvec3 corner, u, v;  // world, m
    double u_m, v_m, scale;   // units a metre

    double x(const glm::dvec3& point) const { return kBorder + glm::dot(point - corner, u) / u_m * scale; }
    double y(const glm::dvec3& point) const { return kBorder + (v_m - glm::dot(point - corner, v) / v_m) * scale; }
    double wide() const { return u_m * scale; }
    double high() const { return v_m * scale; }
};

Plan plan_of(const v1::Grid& grid) {
    Plan plan{vector_of(grid.corner_m()), vector_of(grid.u_m()), vector_of(grid.v_m()), 0, 0, 0};
    // Seen from below the plan would be mirrored: then the edges change places.
    if (glm::cross(plan.u, plan.v).y < 0.0) std::swap(plan.u, plan.v);
    plan.u_m = glm::length(plan.u);
    plan.v_m = glm::length(plan.v);
    plan.scale = std::min(kWide / plan.u_m, kHigh / plan.v_m);
    return plan;
}

// A bar of 1, 2 or 5 times a power of ten, at most a third of the width.
std::string scale_bar(const Plan& plan) {
    const double most_m = plan.u_m / 3.0, decade = std::pow(10.0, std::floor(std::log10(most_m)));
    const double bar_m = decade * (most_m >= 5.0 * decade ? 5.0 : most_m >= 2.0 * decade ? 2.0 : 1.0);
    const double y = kBorder + plan.high() + 20.0, end = kBorder + bar_m * plan.scale;
    return printed("<path d='M%.1f %.1fv6h%.1fv-6' fill='none' stroke='#000'/>", kBorder, y - 3.0, end - kBorder) +
           printed("<text x='%.1f' y='%.1f' font-size='12'>%g m</text>", end + 6.0, y + 4.0, bar_m);
}

std::string light_marks(const Plan& plan, const std::vector<PlanLight>& lights) {
    std::string text;
    const double beyond = std::min(kBorder - 8.0, plan.scale);  // a metre, where there is room
    for (const PlanLight& light : lights) {
        const double x = plan.x(light.position), y = plan.y(light.position);
        if (!(x >= kBorder - beyond && x <= kBorder + plan.wide() + beyond && y >= kBorder - beyond &&
              y <= kBorder + plan.high() + beyond))
            continue;
        text += printed("<g stroke='#b00000' fill='none'><circle cx='%.1f' cy='%.1f' r='7'/>", x, y) +
                printed("<path d='M%.1f %.1fl10 10m0 -10l-10 10'/></g>", x - 5.0, y - 5.0) +
                printed("<text x='%.1f' y='%.1f' font-size='10' fill='#b00000'>", x + 9.0, y - 5.0) +
                escaped(light.name) + "</text>";
    }
    return text;
}

}  // namespace

std::string escaped(std::string_view text) {
    std::string result;
    for (const char c : text) {
        switch (c) {
            case '<':
                result += "&lt;";
                break;
            case '>':
                result += "&gt;";
                break;
            case '&':
                result += "&amp;";
                break;
            case '"':
                result += "&quot;";
                break;
            case '\'':
                result += "&#39;";
                break;
            default:
                if (static_cast<unsigned char>(c) >= 0x20 && c != 0x7f)
                    result += c;
                else if (c == '\n' || c == '\t')
                    result += ' ';
        }
    }
    return result;
}

std::vector<char> counting_points(const v1::GridValues& values) {
    std::vector<char> counts(static_cast<std::size_t>(values.values_lx_size()), 1);
    for (const v1::LeftOutPoint& point : values.left_out())
        if (point.point() < counts.size()) counts[point.point()] = 0;
    return counts;
}

std::string left_out_text(const v1::GridValues& values) {
    std::string text;
    for (const auto& [reason, where] :
         {std::pair("inside", "inside closed bodies"), {"outside", "outside of the room"}}) {
        const auto count = std::ranges::count_if(
            values.left_out(), [&](const v1::LeftOutPoint& point) { return point.reason() == reason; });
        if (count > 0) text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + where;
    }
    return text.empty() ? "" : "points left out: " + text;
}

std::string plan_svg(const v1::GridValues& values, const std::vector<PlanLight>& lights) {
    const Plan plan = plan_of(values.grid());
    const double wide = plan.wide() + 2.0 * kBorder, high = plan.high() + 2.0 * kBorder;
    std::string svg = printed("<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 %.1f %.1f' ", wide, high) +
                      "font-family='sans-serif' role='img' aria-label='plan of grid " + escaped(values.grid().name()) +
                      "'>" +
                      printed("<rect x='%.1f' y='%.1f' width='%.1f' height='%.1f' fill='#fff' stroke='#000'/>", kBorder,
                              kBorder, plan.wide(), plan.high());
    const std::vector<char> counts = counting_points(values);
    int first = -1, last = -1;  // of least and greatest value
    for (int i = 0; i < values.values_lx_size(); ++i) {
        if (counts[static_cast<std::size_t>(i)] == 0) continue;
        if (first < 0 || values.values_lx(i) < values.values_lx(first)) first = i;
        if (last < 0 || values.values_lx(i) > values.values_lx(last)) last = i;
    }
    const double cell = plan.scale * std::min(values.cell_m(0), values.cell_m(1));
    const std::size_t letters = value_text(values.max_lx()).size();
    const double size =
        std::clamp(1.5 * cell / static_cast<double>(std::max<std::size_t>(letters, 3)), kLeastText, kMostText);
    svg += printed("<g text-anchor='middle' font-size='%.1f'>", size);
    for (int i = 0; i < values.values_lx_size(); ++i) {
        const glm::dvec3 point(values.points_m(3 * i), values.points_m(3 * i + 1), values.points_m(3 * i + 2));
        const double value = values.values_lx(i), x = plan.x(point), y = plan.y(point);
        if (counts[static_cast<std::size_t>(i)] == 0) {
            svg += printed("<text x='%.1f' y='%.1f' fill='#888'>–</text>", x, y + 0.35 * size);
            continue;
        }
        const bool low = i == first, high_one = i == last && !low;
        if (low || high_one)
            svg +=
                printed("<rect x='%.1f' y='%.1f' width='%.1f' height='%.1f' rx='2' fill='none' stroke='#000'%s/>",
                        x - 1.05 * size, y - 0.8 * size, 2.1 * size, 1.6 * size, low ? " stroke-dasharray='2 2'" : "");
        svg += printed("<text x='%.1f' y='%.1f'%s>", x, y + 0.35 * size, low || high_one ? " font-weight='bold'" : "") +
               value_text(value) + "</text>";
    }
    svg += "</g>" + light_marks(plan, lights) + scale_bar(plan);
    svg +=
        printed("<text x='%.1f' y='%.1f' font-size='12' text-anchor='middle'>%.2f m</text>",
                kBorder + 0.5 * plan.wide(), kBorder - 10.0, plan.u_m) +
        printed("<text font-size='12' text-anchor='middle' transform='translate(%.1f %.1f) rotate(-90)'>%.2f m</text>",
                kBorder - 10.0, kBorder + 0.5 * plan.high(), plan.v_m);
    return svg + "</svg>";
}

}  // namespace gonio
