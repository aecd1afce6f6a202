// Luminaires that the project wrote itself, as LM-63-2019 text with a flux known in closed form.
// They are the built-in profiles (`--profile downlight`), the scenes' default luminaires and the tests' known lights.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "ies/core/units.h"

namespace gonio::ies {

inline constexpr std::string_view kSyntheticMaker = "Gonio";  // as their files have it

struct SyntheticLuminaire {
    std::string_view name;  // "downlight", "narrow_spot", "batwing", "wall_washer", "linear", "street", "bulb", "flood"
    std::string_view description;  // one sentence with the intensity law
    LuminousFlux flux;             // closed form of the *continuous* law; the file's bilinear web agrees within 0.2 %
};

// Result: all built-in luminaires, in a fixed order.
std::span<const SyntheticLuminaire> synthetic_luminaires();

// Result: the LM-63-2019 text of a built-in luminaire; empty if there is no such name.
std::string synthetic_lm63(std::string_view name);

}  // namespace gonio::ies
