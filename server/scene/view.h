// How a scene is shown: what the picture's values are, and how they become colours.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace gonio {

enum class View : std::uint8_t {
    beauty,
    direct,
    indirect,
    illuminance,
    luminance,
    mask,
    rsm_depth,
    rsm_normal,
    rsm_flux,
    solid
};
// Whether a view shows the scene from the camera, lit: all but those of a luminaire's cube.
inline bool shows_lit_surfaces(View view) {
    return view < View::mask || view == View::solid;
}
enum class Technique : std::uint8_t { standard, seed, seed_disk };
inline constexpr std::uint32_t kDefaultVpls = 4096;  // `samples` of the default technique
inline constexpr std::uint32_t kDefaultSeedSamples =
    400;  // `samples` of the seed technique: its paper's better setting

// How values become colours in the view illuminance, in lx, or luminance, in cd/m²: false_color.h.
struct FalseColor {
    double range_low = 1.0, range_high = 1e4;
    bool range_auto = false;
    bool logarithmic = true;
    unsigned steps = 0;  // 0: smooth
    std::string palette = "classic";
    bool isolux = false;
    std::vector<double> levels;  // that its lines have instead of the scale's; ascending
    double below = 0.0;          // what is less is marked; 0: nothing is
    double compare_range = 500.0;
    bool operator==(const FalseColor&) const = default;
};

// How exposed luminance becomes display values in the views beauty, direct and indirect.
enum class Tone : std::uint8_t { knee, linear, aces, agx, neutral };
struct Look {
    Tone tone = Tone::knee;
    double white_k = 0.0;    // correlated colour temperature of what is white; 0: D65
    double white_duv = 0.0;  // that off the Planckian locus
    bool operator==(const Look&) const = default;
};

}  // namespace gonio
