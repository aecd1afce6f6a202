#include "tests/accuracy/closed_forms.h"

#include <algorithm>
#include <cmath>

#include "ies/web.h"

namespace gonio::accuracy {
namespace {

using ies::kPi;

// Element under a corner of an a x b rectangle.
double parallel_corner(double a, double b, double c) {
    const double x = a / c, y = b / c, p = std::sqrt(1 + x * x), q = std::sqrt(1 + y * y);
    return (x / p * std::atan(y / p) + y / q * std::atan(x / q)) / (2 * kPi);
}

// A corner of the rectangle at the foot: width along the common direction, height above the element's plane.
double perpendicular_corner(double width, double height, double c) {
    if (width == 0.0 || height == 0.0) return 0.0;
    const double x = height / width, y = c / width, r = std::sqrt(x * x + y * y);
    return (std::atan(1 / y) - y / r * std::atan(1 / r)) / (2 * kPi);
}

double odd(double x, double value) {
    return x < 0 ? -value : value;
}

// From the wall's element at height z past the box's edge at (y = edge, z = 1): the lowest visible z on the wall y = 4.
double lowest_seen_from_wall(double z, double edge) {
    return z + (1.0 - z) * 4.0 / edge;
}

constexpr double kBoxFront = 2.5, kBoxBack = 2.7, kFarWall = 4.0, kHeight = 3.0, kHalf = 2.0;

}  // namespace

double parallel_factor(double x0, double x1, double y0, double y1, double c) {
    const auto at = [c](double x, double y) { return odd(x * y, parallel_corner(std::abs(x), std::abs(y), c)); };
    return at(x1, y1) - at(x0, y1) - at(x1, y0) + at(x0, y0);
}

double perpendicular_factor(double x0, double x1, double z0, double z1, double c) {
    const auto at = [c](double x, double z) { return odd(x, perpendicular_corner(std::abs(x), z, c)); };
    return at(x1, z1) - at(x0, z1) - at(x1, z0) + at(x0, z0);
}

double rectangle_solid_angle(double a, double b, double c) {
    return 4 * std::atan(a * b / (4 * c * std::sqrt((a * a + b * b) / 4 + c * c)));
}

double area_source_on_wall(double luminance_nit, double z) {
    return kPi * luminance_nit * perpendicular_factor(-0.5, 0.5, 1.5, 2.5, 3.0 - z);
}

double area_source_on_floor(double luminance_nit, double y) {
    return kPi * luminance_nit * parallel_factor(-0.5, 0.5, 1.5 - y, 2.5 - y, 3.0);
}

double reflection_on_wall(double side, double z) {
    return perpendicular_factor(-side / 2, side / 2, std::max(0.0, 2.0 - side / 2), 2.0 + side / 2, z);
}

double reflection_on_ceiling(double side, double y) {
    return parallel_factor(-side / 2, side / 2, 2.0 - side / 2 - y, 2.0 + side / 2 - y, 3.0);
}

double obstructed_on_wall(double z) {
    const double lowest =
        std::clamp(std::max(lowest_seen_from_wall(z, kBoxFront), lowest_seen_from_wall(z, kBoxBack)), 0.0, kHeight);
    return parallel_factor(-kHalf, kHalf, lowest - z, kHeight - z, kFarWall);
}

double obstructed_on_floor(double y) {
    const double distance = kFarWall - y;
    const double lowest = std::max(distance / (kBoxFront - y), distance / (kBoxBack - y));
    return lowest >= kHeight ? 0.0 : perpendicular_factor(-kHalf, kHalf, lowest, kHeight, distance);
}

double unobstructed_on_wall(double z) {
    return parallel_factor(-kHalf, kHalf, -z, kHeight - z, kFarWall);
}

double unobstructed_on_floor(double y) {
    return perpendicular_factor(-kHalf, kHalf, 0.0, kHeight, kFarWall - y);
}

double mean_indirect(double flux_lm, double area_m2, double rho) {
    return flux_lm * rho / (area_m2 * (1 - rho));
}

double disc_on_axis(double luminance_nit, double r, double d) {
    return kPi * luminance_nit * r * r / (r * r + d * d);
}

}  // namespace gonio::accuracy
