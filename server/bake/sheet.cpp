#include "server/bake/sheet.h"

#include <algorithm>
#include <cmath>

namespace gonio::bake {
namespace {

constexpr double kNothing = 1e-12;  // texel²: less is rounding

// Sutherland and Hodgman 1974: what of the polygon lies on one side of a line through `limit` along an axis.
void cut(const Polygon& in, Polygon& out, int axis, double limit, bool above) {
    out.clear();
    for (std::size_t i = 0; i < in.size(); ++i) {
        const glm::dvec2 a = in[i], b = in[(i + 1) % in.size()];
        const double da = above ? a[axis] - limit : limit - a[axis], db = above ? b[axis] - limit : limit - b[axis];
        if (da >= 0.0) out.push_back(a);
        if ((da > 0.0 && db < 0.0) || (da < 0.0 && db > 0.0)) {
            glm::dvec2 p = a + (b - a) * (da / (da - db));
            p[axis] = limit;
            out.push_back(p);
        }
    }
}

glm::dvec2 centroid(const Polygon& polygon, double area) {
    glm::dvec2 sum(0.0);
    const glm::dvec2 first = polygon.front();  // near it roundings are small
    for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
        const glm::dvec2 a = polygon[i] - first, b = polygon[i + 1] - first;
        sum += (a + b) * cross(a, b);
    }
    return first + sum / (6.0 * area);
}

// Calls job(cell, part of the polygon in it) for every square that it touches.
template <typename Job>
void each_square(const Polygon& polygon, const glm::ivec2& size, Job job) {
    glm::dvec2 low(1e300), high(-1e300);
    for (const glm::dvec2& p : polygon) low = glm::min(low, p), high = glm::max(high, p);
    const glm::ivec2 from = glm::clamp(glm::ivec2(glm::floor(low)), glm::ivec2(0), size - 1),
                     to = glm::clamp(glm::ivec2(glm::ceil(high)) - 1, glm::ivec2(0), size - 1);
    if (from.x >= to.x && from.y >= to.y) {
        job(from, polygon);
        return;
    }
    Polygon row, cell, spare;
    for (int y = from.y; y <= to.y; ++y) {
        // The outermost squares have no outer limit: roundings do not get lost.
        row = polygon;
        if (y > from.y) cut(row, spare, 1, y, true), row.swap(spare);
        if (y < to.y) cut(row, spare, 1, y + 1, false), row.swap(spare);
        if (row.size() < 3) continue;
        for (int x = from.x; x <= to.x; ++x) {
            cell = row;
            if (x > from.x) cut(cell, spare, 0, x, true), cell.swap(spare);
            if (x < to.x) cut(cell, spare, 0, x + 1, false), cell.swap(spare);
            if (cell.size() >= 3) job(glm::ivec2(x, y), cell);
        }
    }
}

}  // namespace

double area_of(const Polygon& polygon) {
    double twice = 0.0;
    for (std::size_t i = 1; i + 1 < polygon.size(); ++i)
        twice += cross(polygon[i] - polygon[0], polygon[i + 1] - polygon[0]);
    return 0.5 * twice;
}

Polygon clipped(const Polygon& polygon, const glm::dvec2& low, const glm::dvec2& high) {
    Polygon result = polygon, spare;
    for (int axis = 0; axis < 2; ++axis) {
        cut(result, spare, axis, low[axis], true);
        cut(spare, result, axis, high[axis], false);
    }
    return result.size() >= 3 && area_of(result) > kNothing ? result : Polygon{};
}

bool contains(const Polygon& polygon, const glm::dvec2& point, double slack) {
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const glm::dvec2 edge = polygon[(i + 1) % polygon.size()] - polygon[i];
        if (cross(edge, point - polygon[i]) < -slack * glm::length(edge)) return false;
    }
    return true;
}

glm::dvec2 barycentric(const std::array<glm::dvec2, 3>& t, const glm::dvec2& point) {
    const glm::dvec2 a = t[1] - t[0], b = t[2] - t[0], p = point - t[0];
    const double whole = cross(a, b);
    if (whole == 0.0) return {1.0 / 3.0, 1.0 / 3.0};
    const double u = std::max(0.0, cross(p, b) / whole), v = std::max(0.0, cross(a, p) / whole);
    const double inside = std::max(1.0, u + v);
    return {u / inside, v / inside};
}

Sheet sheet_of(const trace::Geometry& geometry, const std::vector<Chart>& charts, int number, double texels_per_m) {
    const Chart& chart = charts[static_cast<std::size_t>(number)];
    Sheet sheet;
    sheet.chart = number;
    sheet.sides = chart.sides;
    glm::dvec2 scale(0.0);
    for (int k = 0; k < 2; ++k) {
        const double texels = std::max(1.0, std::ceil(chart.size_m[k] * texels_per_m - 1e-6));
        sheet.size[k] = static_cast<int>(texels);
        scale[k] = texels / std::max(chart.size_m[k], 1e-12);
    }
    for (std::size_t i = 0; i < chart.sides.size(); ++i) {
        const auto corner = corners_of(geometry, chart.sides[i]);
        auto& flat = sheet.flat.emplace_back();
        for (std::size_t k = 0; k < 3; ++k) flat[k] = chart.flat(corner[k]) * scale;
        Polygon outline(flat.begin(), flat.end());
        const double texels = area_of(outline),
                     m2 = 0.5 * glm::length(glm::cross(corner[1] - corner[0], corner[2] - corner[0]));
        sheet.m2_per_texel.push_back(texels > 0.0 ? m2 / texels : 0.0);
        sheet.pieces.push_back({static_cast<int>(i), std::move(outline)});
    }
    return sheet;
}

std::vector<Covered> cover(const Sheet& sheet) {
    struct Square {
        double texels = 0.0, m2 = 0.0, largest = 0.0;
        glm::dvec2 moment{0.0}, centre{0.0}, of_largest{0.0};
        int side = -1;
        bool centre_inside = false;
    };
    const auto width = static_cast<std::size_t>(sheet.size.x);
    std::vector<Square> squares(width * static_cast<std::size_t>(sheet.size.y));
    const auto square_at = [&](const glm::ivec2& at) -> Square& {
        return squares[static_cast<std::size_t>(at.y) * width + static_cast<std::size_t>(at.x)];
    };
    for (const Piece& piece : sheet.pieces) {
        each_square(piece.outline, sheet.size, [&](const glm::ivec2& at, const Polygon& part) {
            const double area = area_of(part);
            if (!(area > 0.0)) return;
            Square& square = square_at(at);
            const glm::dvec2 centre = area > kNothing ? centroid(part, area) : part.front();
            square.texels += area;
            square.m2 += area * sheet.m2_per_texel[static_cast<std::size_t>(piece.side)];
            square.moment += area * centre;
            if (area > square.largest) square.largest = area, square.of_largest = centre, square.side = piece.side;
        });
    }
    for (Square& square : squares) {
        if (square.side >= 0) square.centre = square.moment / square.texels;
    }
    for (const Piece& piece : sheet.pieces) {
        each_square(piece.outline, sheet.size, [&](const glm::ivec2& at, const Polygon& part) {
            Square& square = square_at(at);
            if (square.side < 0 || square.centre_inside || !contains(part, square.centre)) return;
            square.centre_inside = true;
            square.side = piece.side;
        });
    }
    std::vector<Covered> result;
    for (int y = 0; y < sheet.size.y; ++y) {
        for (int x = 0; x < sheet.size.x; ++x) {
            const Square& square = square_at({x, y});
            if (square.side < 0 || square.texels <= kNothing) continue;
            Covered covered;
            covered.at = {x, y};
            covered.side = square.side;
            covered.point = square.centre_inside ? square.centre : square.of_largest;
            const Side& side = sheet.sides[static_cast<std::size_t>(square.side)];
            const glm::dvec2 w = barycentric(sheet.flat[static_cast<std::size_t>(square.side)], covered.point);
            // A back's corners run the other way round.
            covered.u = static_cast<float>(side.back ? w.y : w.x);
            covered.v = static_cast<float>(side.back ? w.x : w.y);
            covered.area_m2 = square.m2;
            result.push_back(covered);
        }
    }
    return result;
}

}  // namespace gonio::bake
