#include "ies/opening.h"

#include <algorithm>
#include <cmath>

namespace gonio::ies::detail {

namespace {

int sign(double value) {
    return value > 0.0 ? 1 : value < 0.0 ? -1 : 0;
}

struct Row {
    int width, length, height;
    OpeningShape shape;
};

// Signs of width, length, height -> shape. Where a version gives a round shape by one number only, the others are 0.
constexpr Row kRows[] = {
    {0, 0, 0, OpeningShape::point},
    {1, 1, 0, OpeningShape::rectangle},
    {1, 1, 1, OpeningShape::box},
    {0, 1, 1, OpeningShape::box},
    {1, 0, 1, OpeningShape::box},
    {0, 1, 0, OpeningShape::rectangle},  // a line
    {1, 0, 0, OpeningShape::rectangle},  // a line
    {0, 0, 1, OpeningShape::box},        // a line
    {-1, -1, 0, OpeningShape::ellipse},
    {-1, 0, 0, OpeningShape::ellipse},  // 1986-1995
    {0, -1, 0, OpeningShape::ellipse},  // seen under 2002 headers
    {-1, 1, 0, OpeningShape::ellipse},  // 1986-1991
    {1, -1, 0, OpeningShape::ellipse},
    {-1, -1, 1, OpeningShape::vertical_cylinder},
    {-1, 0, 1, OpeningShape::vertical_cylinder},  // 1986-1995
    {0, -1, 1, OpeningShape::vertical_cylinder},  // seen under 2002 headers
    {-1, -1, -1, OpeningShape::ellipsoid},
    {-1, 0, -1, OpeningShape::ellipsoid},  // 1995 sphere
    {-1, 1, 1, OpeningShape::ellipsoid},   // 1986-1991
    {1, -1, 1, OpeningShape::ellipsoid},
    {0, 1, -1, OpeningShape::horizontal_cylinder_length},  // 1995
    {-1, 1, -1, OpeningShape::ellipsoid},                  // 1995
    {1, 0, -1, OpeningShape::horizontal_cylinder_width},   // 1995
    {1, -1, -1, OpeningShape::ellipsoid},                  // 1995
};

// Signs that 1995 and 2002 use differently; from 2002 on these win.
constexpr Row kRowsSince2002[] = {
    {-1, 1, -1, OpeningShape::horizontal_cylinder_length},
    {1, -1, -1, OpeningShape::horizontal_cylinder_width},
    {-1, 0, -1, OpeningShape::vertical_ellipse},
};

}  // namespace

Opening decode_opening(int year, double width, double length, double height, std::size_t offset, Report& report) {
    const auto matches = [&](const Row& r) {
        return r.width == sign(width) && r.length == sign(length) && r.height == sign(height);
    };
    const auto find = [&](const auto& rows) {
        const auto found = std::find_if(std::begin(rows), std::end(rows), matches);
        return found == std::end(rows) ? nullptr : &*found;
    };
    const Row* row = year >= 2002 ? find(kRowsSince2002) : nullptr;
    if (row == nullptr) row = find(kRows);
    if (row == nullptr) {
        report.warn("unknown_opening", offset, "no LM-63 version knows these signs of width, length and height");
        return {};
    }
    Opening opening{row->shape, std::abs(width) * m, std::abs(length) * m, std::abs(height) * m};
    // A diameter given once stands for both sides.
    switch (row->shape) {
        case OpeningShape::ellipse:
        case OpeningShape::vertical_cylinder:
            if (width == 0.0) opening.width = opening.length;
            if (length == 0.0) opening.length = opening.width;
            break;
        case OpeningShape::horizontal_cylinder_length:
            if (width == 0.0) opening.width = opening.height;
            break;
        case OpeningShape::horizontal_cylinder_width:
            if (length == 0.0) opening.length = opening.height;
            break;
        case OpeningShape::ellipsoid:
            if (length == 0.0) opening.length = opening.width;
            break;
        default:
            break;
    }
    return opening;
}

}  // namespace gonio::ies::detail
