#include "server/render/passes/composite_defines.h"

#include <string>

#include "server/scene/false_color.h"

namespace gonio {

bool composite_looks(const CompositeParts& parts) {
    return shows_lit_surfaces(parts.view) && !is_false_color(parts.view) && !parts.raw && !(parts.look == Look());
}

gl::Defines composite_defines(const CompositeParts& parts) {
    const bool lit = shows_lit_surfaces(parts.view),
               shines = parts.view != View::direct && parts.view != View::indirect;
    const std::pair<const char*, bool> options[] = {{"RAW", parts.raw},
                                                    {"EMISSIVE", parts.emissive && lit && shines},
                                                    {"OPENINGS", parts.openings && lit},
                                                    {"EDGES", parts.edges && lit},
                                                    {"HAZE", parts.haze && lit},
                                                    {"WORK_LIGHT", parts.work_light && parts.view == View::beauty}};
    gl::Defines defines = {{"VIEW", std::to_string(static_cast<int>(parts.view))}};
    for (const auto& [name, wanted] : options)
        if (wanted) defines.emplace_back(name, "1");
    if (composite_looks(parts)) defines.emplace_back("TONE", std::to_string(static_cast<int>(parts.look.tone)));
    return defines;
}

}  // namespace gonio
