// The plan of a calculation grid: its values, to scale, and the luminaires where they stand on it. Pure.
#pragma once

#include <glm/glm.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/schema/messages.h"

namespace gonio {

struct PlanLight {
    std::string name;
    glm::dvec3 position{0.0};  // world, m
};

// Result: an SVG drawing without scripts and styles: the rectangle as seen from its upper side, with a scale in metres.
// Values are in whole lux, with one decimal below 10; least and greatest are marked. A point that is left out has a
// dash. Lights stand at their foot on the
// grid's plane; those farther than a metre outside are left out.
std::string plan_svg(const v1::GridValues& values, const std::vector<PlanLight>& lights);

// Result: of each point whether it counts: 1, or 0 where it is left out.
std::vector<char> counting_points(const v1::GridValues& values);
// Result: how many points are left out, and why: "points left out: 4 inside closed bodies"; empty: none is.
std::string left_out_text(const v1::GridValues& values);

// Result: the text with <, >, &, " and ' as entities, and without control characters: for HTML and XML.
std::string escaped(std::string_view text);

}  // namespace gonio
