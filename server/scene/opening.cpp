#include "server/scene/opening.h"

#include "protocol/schema/words.h"

namespace gonio {
namespace {

using Shape = ies::OpeningShape;

// How many measures a word has, and which of length, width and height they are.
struct Word {
    const char* name;
    Shape shape;
    int measures;
    bool width, height;  // else a disc's or a sphere's are its diameter, a line's 0
};
constexpr Word kWords[] = {
    {"rect", Shape::rectangle, 2, true, false},  {"box", Shape::box, 3, true, true},
    {"disc", Shape::ellipse, 1, false, false},   {"sphere", Shape::ellipsoid, 1, false, false},
    {"line", Shape::rectangle, 1, false, false},
};
constexpr double kLeast_m = 0.001, kMost_m = 100.0;

const char* name_of(Shape shape) {
    switch (shape) {
        case Shape::vertical_cylinder:
            return "vertical-cylinder";
        case Shape::horizontal_cylinder_length:
            return "cylinder-along-length";
        case Shape::horizontal_cylinder_width:
            return "cylinder-along-width";
        case Shape::vertical_ellipse:
            return "vertical-ellipse";
        case Shape::ellipse:
            return "ellipse";
        case Shape::ellipsoid:
            return "ellipsoid";
        default:
            return "box";
    }
}

}  // namespace

ies::Opening opening_of(const Light& light) {
    if (light.sun) return {};
    return light.opening.value_or(light.profile->photometry.opening);
}

std::optional<ies::Opening> parse_opening(const std::string& text) {
    if (text == "point") return ies::Opening();
    for (const Word& word : kWords) {
        const std::string start = std::string(word.name) + " ";
        if (text.compare(0, start.size(), start) != 0) continue;
        double measure[3] = {};
        std::size_t at = start.size();
        for (int i = 0; i < word.measures; ++i) {
            const std::size_t end = i + 1 < word.measures ? text.find('x', at) : text.size();
            if (end == std::string::npos) return std::nullopt;
            const auto number = parse_number(std::string_view(text).substr(at, end - at));
            if (!number || !(*number >= kLeast_m && *number <= kMost_m)) return std::nullopt;
            measure[i] = *number;
            at = end + 1;
        }
        ies::Opening opening{word.shape, 0.0 * m, measure[0] * m, 0.0 * m};
        if (word.width) opening.width = measure[1] * m;
        if (word.height) opening.height = measure[2] * m;
        if (word.shape == Shape::ellipse || word.shape == Shape::ellipsoid) opening.width = opening.length;
        if (word.shape == Shape::ellipsoid) opening.height = opening.length;
        return opening;
    }
    return std::nullopt;
}

std::string print_opening(const ies::Opening& opening) {
    const double length = opening.length.in(m), width = opening.width.in(m), height = opening.height.in(m);
    if (opening.shape == Shape::point) return "point";
    if (opening.shape == Shape::rectangle) {
        if (width > 0.0 && length > 0.0) return "rect " + print_number(length) + "x" + print_number(width);
        if (length > 0.0) return "line " + print_number(length);
    }
    if (opening.shape == Shape::ellipse && length == width) return "disc " + print_number(length);
    if (opening.shape == Shape::ellipsoid && length == width && width == height)
        return "sphere " + print_number(length);
    return std::string(name_of(opening.shape)) + " " + print_number(length) + "x" + print_number(width) + "x" +
           print_number(height);
}

}  // namespace gonio
