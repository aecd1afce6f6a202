#include "server/scene/opening_points.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gonio {
namespace {

using Shape = ies::OpeningShape;

// Gauss's points of two in each of n / 2 equal parts of 0 … 1; of one the middle.
std::vector<double> gauss(unsigned n) {
    if (n < 2) return {0.5};
    constexpr double kOff = 0.28867513459481287;  // 1 / (2 sqrt(3))
    std::vector<double> points;
    for (unsigned i = 0; i < n / 2; ++i)
        for (const double off : {-kOff, kOff}) points.push_back((i + 0.5 + off) / (n / 2));
    return points;
}

std::vector<double> round_the_clock(unsigned n) {
    std::vector<double> turns;
    for (unsigned i = 0; i < n; ++i) turns.push_back((i + 0.5) / n);
    return turns;
}

// Parts of a side where the longest is in `most`: as few, of a power of two, as are no longer.
unsigned parts_of(double side_m, double longest_m, unsigned most) {
    unsigned n = most;
    while (n > 1 && side_m * (most / (n / 2)) <= longest_m * 1.0001) n /= 2;
    return n;
}

double halved(unsigned bits) {  // the digits of a number of base 2, behind the point in reverse order
    double value = 0.0, digit = 0.5;
    for (; bits != 0; bits >>= 1, digit *= 0.5) value += (bits & 1u) != 0 ? digit : 0.0;
    return value;
}

bool flat(Shape shape) {
    return shape == Shape::rectangle || shape == Shape::ellipse;
}

}  // namespace

glm::dvec3 opening_point(const ies::Opening& opening, const glm::dvec2& first, const glm::dvec2& second) {
    const double x = opening.length.in(m), y = opening.width.in(m), z = opening.height.in(m);
    const double a = first.x - 0.5, b = first.y - 0.5, c = second.x - 0.5;
    const double turn = 2.0 * std::numbers::pi * first.y, root = 0.5 * std::sqrt(first.x);
    switch (opening.shape) {
        case Shape::point:
            break;
        case Shape::rectangle:
            return {a * x, b * y, 0.0};
        case Shape::box: {  // bottom and the four sides, by area
            const double areas[] = {x * y, x * z, x * z, y * z, y * z};
            double pick = second.x * (areas[0] + 2.0 * areas[1] + 2.0 * areas[3]);
            int face = 0;
            while (face < 4 && pick > areas[face]) pick -= areas[face++];
            return face == 0   ? glm::dvec3(a * x, b * y, -0.5 * z)
                   : face <= 2 ? glm::dvec3(a * x, face == 1 ? 0.5 * y : -0.5 * y, b * z)
                               : glm::dvec3(face == 3 ? 0.5 * x : -0.5 * x, a * y, b * z);
        }
        case Shape::ellipse:
            return {root * x * std::cos(turn), root * y * std::sin(turn), 0.0};
        case Shape::vertical_cylinder:
            return {0.5 * x * std::cos(turn), 0.5 * y * std::sin(turn), c * z};
        case Shape::ellipsoid: {
            const double height = 1.0 - 2.0 * first.x, radius = std::sqrt(std::max(0.0, 1.0 - height * height));
            return 0.5 * glm::dvec3(x * radius * std::cos(turn), y * radius * std::sin(turn), z * height);
        }
        case Shape::horizontal_cylinder_length:
            return {c * x, 0.5 * y * std::cos(turn), 0.5 * z * std::sin(turn)};
        case Shape::horizontal_cylinder_width:
            return {0.5 * x * std::cos(turn), c * y, 0.5 * z * std::sin(turn)};
        case Shape::vertical_ellipse:
            return {0.0, root * y * std::cos(turn), root * z * std::sin(turn)};
    }
    return glm::dvec3(0.0);
}

glm::dvec3 half_sides(const ies::Opening& opening) {
    glm::dvec3 half = 0.5 * glm::dvec3(opening.length.in(m), opening.width.in(m), opening.height.in(m));
    if (opening.shape == Shape::point) half = glm::dvec3(0.0);
    if (flat(opening.shape)) half.z = 0.0;
    if (opening.shape == Shape::vertical_ellipse) half.x = 0.0;
    return half;
}

glm::dvec3 lifted_off(const ies::Opening& opening) {
    return {0.0, 0.0, flat(opening.shape) ? -0.001 : 0.0};
}

OpeningParts opening_parts(const ies::Opening& opening, unsigned level) {
    const glm::dvec3 side = 2.0 * half_sides(opening);
    const double longest = std::max({side.x, side.y, side.z});
    const unsigned n = 1u << level;
    OpeningParts parts{longest / n, {}};
    if (level == 0 || opening.shape == Shape::point) {
        parts.points = {glm::dvec3(0.0)};
        return parts;
    }
    const auto add = [&](const std::vector<double>& first, const std::vector<double>& turns,
                         const std::vector<double>& second) {
        for (const double c : second)
            for (const double a : first)
                for (const double b : turns) parts.points.push_back(opening_point(opening, {a, b}, {c, 0.5}));
    };
    switch (opening.shape) {
        case Shape::rectangle:
            add(gauss(parts_of(side.x, longest, n)), gauss(parts_of(side.y, longest, n)), {0.5});
            break;
        case Shape::box: {
            // Along the golden numbers of two and of one dimension.
            for (unsigned i = 0; i < n * n; ++i) {
                const auto part = [&](double step) { return std::fmod(0.5 + i * step, 1.0); };
                parts.points.push_back(opening_point(opening, {part(0.7548776662466927), part(0.5698402909980532)},
                                                     {(i + 0.5) / (n * n), 0.5}));
            }
            break;
        }
        case Shape::ellipse:
        case Shape::vertical_ellipse:
        case Shape::ellipsoid:  // rings of equal area, 4 points or more on each
            add(gauss(n / 2), round_the_clock(2 * n), {0.5});
            break;
        case Shape::vertical_cylinder:
        case Shape::horizontal_cylinder_length:
        case Shape::horizontal_cylinder_width: {
            const double axis = opening.shape == Shape::vertical_cylinder            ? side.z
                                : opening.shape == Shape::horizontal_cylinder_length ? side.x
                                                                                     : side.y;
            add({0.5}, round_the_clock(std::max(4u, parts_of(side.x + side.y + side.z - axis, longest, n))),
                gauss(parts_of(axis, longest, n)));
            break;
        }
        case Shape::point:
            break;
    }
    return parts;
}

std::vector<glm::dvec3> opening_spread(const ies::Opening& opening, unsigned n) {
    std::vector<glm::dvec3> points;
    for (unsigned i = 0; i < n; ++i) {
        const double even = (i + 0.5) / n, digits = halved(i) + 0.5 / n;
        // The second pair picks a box's face and a cylinder's height.
        const glm::dvec2 first = opening.shape == Shape::box
                                     ? glm::dvec2(digits, std::fmod(0.5 + i * 0.6180339887498949, 1.0))
                                     : glm::dvec2(even, digits);
        points.push_back(opening_point(opening, first, {even, 0.5}));
    }
    return points;
}

}  // namespace gonio
