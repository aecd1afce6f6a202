// The names that a control chooses from, in rows of the patch and of the map of fader boxes. Pure.
#pragma once

#include <algorithm>
#include <string>

#include "ies/core/text.h"
#include "protocol/schema/property.h"

namespace gonio {

inline constexpr int kMaxListedNames = 256;

// luminaires: the built-in ones. Result: why the row's names cannot be those of the property; empty where they can.
// Gels are not known here: those of a file may come later, and a name that none has is refused when it is chosen.
template <typename Names, typename Luminaires>
std::string wrong_list(const PropertyRow& property, const Names& names, const Luminaires& luminaires) {
    if (property.by_list != (names.size() > 0) || names.size() > kMaxListedNames)
        return property.by_list ? "must list 1 to 256 names"
                                : "only the properties profile and gel have a list of names";
    for (const std::string& name : names) {
        if (name.size() > 128) return "a name has at most 128 bytes";
        const bool known = property.property != Property::profile ||
                           std::any_of(luminaires.begin(), luminaires.end(),
                                       [&](const auto& luminaire) { return luminaire.name == name; });
        if (!known) return "'" + shown_text(name) + "' is not the name of a built-in luminaire";
    }
    return {};
}

}  // namespace gonio
