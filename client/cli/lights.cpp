// Lights and groups as tables.
#include <cstdio>

#include "client/cli/output.h"
#include "client/cli/table.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/state.pb.h"

namespace gonio {
namespace {

std::string rounded(double value, const char* format) {
    char text[64];
    std::snprintf(text, sizeof text, format, value);
    return text;
}

}  // namespace

std::string lights_table(const v1::State& state) {
    std::vector<Cells> rows{{"light", "fixture", "level", "lm", "position, m", "luminaire"}};
    for (const v1::Light& light : state.lights()) {
        std::string place;
        for (const double x : light.position()) place += (place.empty() ? "" : ",") + rounded(x, "%.3g");
        rows.push_back({light.name(), light.fixture().empty() ? "-" : light.fixture(),
                        rounded(100 * light.level_ratio(), "%.3g%%"),
                        light.sun() ? "-" : rounded(light.flux_lm(), "%.0f"), light.sun() ? "sun" : place,
                        (light.product().empty() ? light.profile() : light.product()) +
                            (light.missing() ? " (missing in the show)" : "")});
    }
    return aligned(rows);
}

std::string groups_table(const v1::State& state) {
    std::vector<Cells> rows{{"group", "lights"}};
    for (const v1::Group& group : state.groups()) {
        std::string names;
        for (const std::string& name : group.lights()) names += (names.empty() ? "" : ", ") + name;
        rows.push_back({group.name(), names});
    }
    return aligned(rows);
}

}  // namespace gonio
