#include "ies/synthetic.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <vector>

#include "ies/web.h"

namespace gonio::ies {

namespace {

// c, s: cosine and sine of the angle from nadir; h in radians. Candela.
using Law = double (*)(double c, double s, double h);

double power(double base, int exponent) {
    double result = 1.0;
    for (int i = 0; i < exponent; ++i) result *= base;
    return result;
}

double downlight(double c, double, double) {
    return 2400.0 * power(std::max(c, 0.0), 4);
}
double narrow_spot(double c, double, double) {
    return c > 0.0 ? 40000.0 * std::exp(200.0 * (c - 1.0)) : 0.0;
}
double batwing(double c, double s, double) {
    return 450.0 * std::max(c, 0.0) * (1.0 + 4.0 * s * s);
}
double wall_washer(double c, double s, double h) {
    return 350.0 * std::max(c, 0.0) * power(1.0 + s * std::cos(h), 4);
}
double linear(double c, double s, double h) {
    return c >= 0.0 ? 600.0 * c * (1.0 + 2.0 * power(s * std::sin(h), 2)) : -300.0 * c;
}
double street(double c, double s, double h) {
    return 300.0 * std::max(c, 0.0) * (1.0 + 30.0 * power(s, 4) * power(std::sin(h), 2) * (1.0 + std::cos(h)));
}
double bulb(double c, double, double) {
    return 75.0 * (1.0 - power(0.5 * (1.0 - c), 8));
}
double flood(double c, double, double) {
    const double t = 2.0 * (1.0 - c);  // 1 at 60 degrees
    return t < 1.0 ? 2500.0 * (1.0 - power(t, 4)) : 0.0;
}

// Angles from 0 in equal steps, degrees; end 0: one angle.
struct Steps {
    double step, end;
};

struct Recipe {
    SyntheticLuminaire luminaire;
    Law law;
    Steps v, h;  // h.end 0: axially symmetric
    double width_m, length_m, height_m;
    double watts;
};

// Each flux is the integral of I sin(theta) over the sphere in closed form; the derivation follows the law in one line.
// With c = cos, s = sin of the angle from nadir over the lower half: integral of c^n s = 1/(n+1), of c s^(2k+1) =
// 1/(2k+2); over the azimuth: cos^2 and sin^2 give pi, cos^4 gives 3 pi/4, odd powers of cos give 0.
// clang-format off
const std::array<Recipe, 8> kRecipes{{
    {{"downlight", "I = 2400 cd cos^4(theta), lower half",
      2.0 * kPi * 2400.0 / 5.0 * lm},
     downlight, {2.5, 90.0}, {0.0, 0.0}, -0.15, -0.15, 0.0, 28.0},
    {{"narrow_spot", "I = 40000 cd exp(200 (cos(theta) - 1)), lower half: 9.5 degree beam",
      2.0 * kPi * 40000.0 / 200.0 * (1.0 - std::exp(-200.0)) * lm},
     narrow_spot, {0.5, 90.0}, {0.0, 0.0}, -0.1, -0.1, 0.0, 15.0},
    {{"batwing", "I = 450 cd cos(theta) (1 + 4 sin^2(theta)), lower half: peak at 50 degrees",
      2.0 * kPi * 450.0 * (1.0 / 2.0 + 4.0 / 4.0) * lm},
     batwing, {2.5, 90.0}, {0.0, 0.0}, 0.6, 0.6, 0.0, 36.0},
    {{"wall_washer", "I = 350 cd cos(theta) (1 + sin(theta) cos(h))^4, lower half: thrown towards h = 0",
      350.0 * (kPi + 6.0 * kPi / 4.0 + 3.0 * kPi / 4.0 / 6.0) * lm},
     wall_washer, {2.5, 90.0}, {7.5, 180.0}, 0.1, 0.3, 0.0, 26.0},
    {{"linear", "I = 600 cd cos(theta) (1 + 2 sin^2(theta) sin^2(h)) down, 300 cd |cos(theta)| up",
      (600.0 * (kPi + 2.0 * kPi / 4.0) + 300.0 * kPi) * lm},
     linear, {2.5, 180.0}, {7.5, 90.0}, 0.06, 1.2, 0.0, 34.0},
    {{"street", "I = 300 cd cos(theta) (1 + 30 sin^4(theta) sin^2(h) (1 + cos(h))), lower half: street side h = 0",
      300.0 * (kPi + 30.0 * kPi / 6.0) * lm},
     street, {2.5, 90.0}, {7.5, 180.0}, 0.2, 0.4, 0.0, 48.0},
    {{"bulb", "I = 75 cd (1 - ((1 - cos(theta)) / 2)^8), whole sphere: dark towards the cap only",
      4.0 * kPi * 75.0 * (1.0 - 1.0 / 9.0) * lm},
     bulb, {2.5, 180.0}, {0.0, 0.0}, -0.06, -0.06, -0.06, 8.0},
    {{"flood", "I = 2500 cd (1 - (2 (1 - cos(theta)))^4) within 60 degrees, dark outside",
      2.0 * kPi * 2500.0 * 0.5 * (1.0 - 1.0 / 5.0) * lm},
     flood, {1.0, 90.0}, {0.0, 0.0}, 0.3, 0.3, 0.0, 55.0},
}};
// clang-format on

std::vector<double> angles_of(const Steps& steps) {
    std::vector<double> result;
    const int count = steps.end > 0.0 ? static_cast<int>(std::lround(steps.end / steps.step)) : 0;
    for (int i = 0; i <= count; ++i) result.push_back(i * steps.step);
    return result;
}

void append_number(std::string& text, double value) {
    std::array<char, 32> buffer{};
    const auto end =
        std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, std::chars_format::fixed, 3).ptr;
    std::string_view digits(buffer.data(), static_cast<std::size_t>(end - buffer.data()));
    while (digits.back() == '0') digits.remove_suffix(1);
    if (digits.back() == '.') digits.remove_suffix(1);
    text += digits == "-0" ? "0" : digits;
}

void append_row(std::string& text, const std::vector<double>& values) {
    constexpr std::size_t kPerLine = 10;
    for (std::size_t i = 0; i < values.size(); ++i) {
        append_number(text, values[i]);
        text += i + 1 == values.size() || i % kPerLine == kPerLine - 1 ? '\n' : ' ';
    }
}

std::string write(const Recipe& recipe) {
    const std::vector<double> v = angles_of(recipe.v);
    const std::vector<double> h = angles_of(recipe.h);
    std::string text = "IES:LM-63-2019\n[TEST] synthetic\n[TESTLAB] none: computed from a formula\n";
    text += "[ISSUEDATE] 2026-01-01\n[MANUFAC] " + std::string(kSyntheticMaker) + "\n[LUMCAT] " +
            std::string(recipe.luminaire.name);
    text += "\n[LUMINAIRE] " + std::string(recipe.luminaire.description) + "\nTILT=NONE\n";
    append_row(text, {1, -1, 1, static_cast<double>(v.size()), static_cast<double>(h.size()), 1, 2, recipe.width_m,
                      recipe.length_m, recipe.height_m});
    // 1.0001: computer simulation (LM-63-2019 table 2).
    text += "1 1.00010 ";
    append_row(text, {recipe.watts});
    append_row(text, v);
    append_row(text, h);
    std::vector<double> row;
    for (const double plane : h) {
        row.clear();
        for (const double angle : v) {
            const double theta = angle * kPi / 180.0;
            // At 90 and 180 degrees the table holds the exact 0, not the rounding of the cosine.
            const double c = angle == 90.0 ? 0.0 : std::cos(theta);
            row.push_back(recipe.law(c, angle == 180.0 ? 0.0 : std::sin(theta), plane * kPi / 180.0));
        }
        append_row(text, row);
    }
    return text;
}

}  // namespace

std::span<const SyntheticLuminaire> synthetic_luminaires() {
    static const std::array<SyntheticLuminaire, kRecipes.size()> list = [] {
        std::array<SyntheticLuminaire, kRecipes.size()> result;
        for (std::size_t i = 0; i < result.size(); ++i) result[i] = kRecipes[i].luminaire;
        return result;
    }();
    return list;
}

std::string synthetic_lm63(std::string_view name) {
    for (const Recipe& recipe : kRecipes) {
        if (recipe.luminaire.name == name) return write(recipe);
    }
    return {};
}

}  // namespace gonio::ies
