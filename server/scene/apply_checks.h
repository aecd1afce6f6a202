// Of apply(): how a command's values are checked, and how a checked one gets into the scene. Queries print as it does.
#pragma once

#include <cmath>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "ies/core/result.h"
#include "protocol/text/did_you_mean.h"
#include "protocol/text/shortened_text.h"
#include "server/scene/light_values.h"
#include "server/scene/limits.h"
#include "server/scene/scene.h"

namespace gonio {

// All refusals leave through this exception and end in apply(): a refused command has touched nothing but a copy.
struct Refused {
    Error error;
};

[[noreturn]] inline void refuse(std::string code, std::string where, std::string value, std::string message) {
    throw Refused{{std::move(code), std::move(where), std::move(value), std::move(message)}};
}

// Refuses a name that none of a kind has, such as "preset". known: all of that kind, by name.
template <typename Known>
[[noreturn]] void refuse_unknown(std::string where, const std::string& name, const std::string& kind,
                                 const Known& known) {
    std::vector<std::string_view> names;
    for (const auto& [other, value] : known) names.push_back(other);
    refuse("not_found", std::move(where), shortened_text(name, kMaxNameBytes),
           with_hint("there is no " + kind + " of this name", name, names));
}

// How far beyond an end of its range a value may be and still counts as that end. Clients sum in 32 bits: eleven steps
// of 0.1 from 0 end at 1.0000001, and on the way down at -7e-8 rather than 0.
inline constexpr double kRoundingRatio = 1e-5;  // of the end; where that is 0: of 1

// Result: the end of the range that the value misses by rounding alone; any other value as it is.
inline double without_rounding(double value, double low, double high) {
    const auto slack = [](double end) { return kRoundingRatio * (end == 0 ? 1.0 : std::abs(end)); };
    if (value < low && value >= low - slack(low)) return low;
    if (value > high && value <= high + slack(high)) return high;
    return value;
}

inline double checked(double value, double low, double high, const std::string& field) {
    value = without_rounding(value, low, high);
    if (!(value >= low && value <= high)) {
        refuse("invalid_argument", field, print_number(value),
               "must be a number from " + print_number(low) + " to " + print_number(high));
    }
    return value;
}

// A number of a property, by its row.
inline double checked(double value, const PropertyRow& row, const std::string& field) {
    if (row.or_none && without_rounding(value, 0.0, 0.0) == 0) return 0.0;
    value = without_rounding(value, row.least, row.most);
    if (!row.or_none || (value >= row.least && value <= row.most)) return checked(value, row.least, row.most, field);
    refuse("invalid_argument", field, print_number(value),
           "must be 0 or a number from " + print_number(row.least) + " to " + print_number(row.most));
}

template <typename Field>
std::string print_all(const Field& field) {
    std::string text;
    for (double value : field) text += (text.empty() ? "" : ",") + print_number(value);
    return text;
}

template <typename Field>
glm::dvec3 checked_vector(const Field& field, double low, double high, const std::string& name) {
    if (std::size(field) != 3) refuse("invalid_argument", name, print_all(field), "must be three numbers");
    glm::dvec3 result;
    for (int i = 0; i < 3; ++i) {
        result[i] = without_rounding(field[i], low, high);
        if (!(result[i] >= low && result[i] <= high)) {
            refuse("invalid_argument", name, print_all(field),
                   "must be three numbers from " + print_number(low) + " to " + print_number(high));
        }
    }
    return result;
}

template <typename Field>
glm::dvec3 checked_direction(const Field& field, const std::string& name) {
    const glm::dvec3 d = checked_vector(field, -1e9, 1e9, name);
    if (glm::length(d) < 1e-9) refuse("invalid_argument", name, print_all(field), "must not be the zero vector");
    return glm::normalize(d);
}

inline std::string checked_name(const std::string& name, const std::string& field) {
    if (name.empty() || name.size() > kMaxNameBytes) {
        refuse("invalid_argument", field, shortened_text(name, kMaxNameBytes), "must have 1 to 128 bytes");
    }
    const std::string shown = shortened_text(name, kMaxNameBytes);
    if (shown != name)
        refuse("invalid_argument", field, shown,
               "must be UTF-8 without control characters, also none of the direction of writing");
    return name;
}

// Assigns and bumps the part's revision only where the value differs.
template <typename T>
void change(Scene& scene, T& now, const T& value, Revision& part_rev) {
    if (now == value) return;
    now = value;
    part_rev = scene.scene_rev + 1;
}

inline void change(Scene& scene, Light& light, const LightRow& light_row, const Numbers& numbers) {
    if (numbers_of(light, light_row) == numbers) return;
    set_numbers(light, light_row, numbers);
    light.*light_row.stale = scene.scene_rev + 1;
}

}  // namespace gonio
