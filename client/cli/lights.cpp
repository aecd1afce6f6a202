// Lights, groups, presets and views of the camera as tables.
#include <cstdio>
#include <numbers>

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

// Result: the coordinates in m, joined by commas as --position takes them.
std::string place_of(const google::protobuf::RepeatedField<double>& position) {
    std::string place;
    for (const double x : position) place += (place.empty() ? "" : ",") + rounded(x, "%.3g");
    return place;
}

}  // namespace

std::string lights_table(const v1::State& state) {
    std::vector<Cells> rows{{"light", "fixture", "level", "lm", "position, m", "luminaire"}};
    for (const v1::Light& light : state.lights()) {
        rows.push_back({light.name(), light.fixture().empty() ? "-" : light.fixture(),
                        rounded(100 * light.level_ratio(), "%.3g%%"),
                        light.sun() ? "-" : rounded(light.flux_lm(), "%.0f"),
                        light.sun() ? "sun" : place_of(light.position()),
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

std::string presets_table(const v1::State& state) {
    std::vector<Cells> rows{{"preset", "recalled last"}};
    for (const std::string& name : state.presets().names())
        rows.push_back({name, name == state.presets().recalled() ? "yes" : ""});
    return aligned(rows);
}

std::string views_table(const v1::State& state) {
    std::vector<Cells> rows{{"view", "eye, m", "target, m", "field of view"}};
    for (const v1::SavedView& view : state.saved_views().views())
        rows.push_back({view.name(), place_of(view.camera().eye()), place_of(view.camera().target()),
                        rounded(view.camera().fov_rad() * 180.0 / std::numbers::pi, "%.3g°")});
    return aligned(rows);
}

}  // namespace gonio
