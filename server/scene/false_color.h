// False colour of the views illuminance and luminance: its settings, the scale that they make, and the state message.
// Pure functions, any thread.
#pragma once

#include <string>
#include <vector>

#include "server/scene/view.h"
#include "shaders/shared/layouts.h"

namespace gonio {
struct Scene;
}  // namespace gonio

namespace gonio::v1 {
class FalseColor;
}

namespace gonio {

inline constexpr double kMaxRange = 1e9, kMinLogRange = 1e-6;  // lx or cd/m²
inline constexpr unsigned kMostSteps = 27;
inline constexpr std::size_t kMostLevels = GONIO_MAX_LEVELS, kMostGivenLevels = 16;

// Result: whether it is one of the two.
bool is_false_color(View view);
// Result: the settings of a view; of others those of illuminance.
const FalseColor& false_color_of(const Scene& scene, View view);
// Result: whether the view shows the difference from a preset, or one light alone: of the two views only.
bool shows_difference(const Scene& scene, View view);
bool shows_one_light(const Scene& scene, View view);

// What the colours stand for, in lx or cd/m².
struct FalseScale {
    double low = 0.0, high = 1.0;
    bool logarithmic = false;
    unsigned steps = 0;
};
// difference: of one it is linear and symmetrical, with the steps that there are.
FalseScale scale_of(const FalseColor& settings, bool difference);
// Result: figures for the legend, at most kMostLevels, ascending: the borders of the steps, ends included; or
// 1-2-5 of each decade, or decades where those are many; or round figures.
std::vector<double> ticks_of(const FalseScale& scale);
// Result: where isolux lines run, at most kMostLevels, ascending: the levels that were given, but for a difference;
// else ticks inside the scale; and the threshold.
std::vector<double> isolux_levels(const FalseColor& settings, bool difference);

// Result: what shaders and false_color() make colours by. lines: with the isolux levels.
layouts::FalseColorBlock color_block(const FalseColor& settings, bool difference);
// Result: R'G'B' of 0..1 of a value, as shaders/passes/composite.frag has it.
glm::vec3 false_color(const layouts::FalseColorBlock& block, float value);
// Result: how many levels a value has reached.
int levels_reached(const layouts::FalseColorBlock& block, float value);

// Result: "500", "0.25", "2k": as short as it can be told.
std::string figure(double value);

void put_false_color(const FalseColor& settings, bool difference, v1::FalseColor& out);

}  // namespace gonio
