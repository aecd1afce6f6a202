// Lights and groups as tables.
#include <algorithm>
#include <span>

#include "client/cli/output.h"
#include "ies/core/text.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/state.pb.h"

namespace gonio {
namespace {

using Cells = std::vector<std::string>;

std::size_t width_of(std::string_view text) {
    std::size_t characters = 0;
    for (std::size_t at = 0; at < text.size(); ++characters) at += std::max<std::size_t>(utf8_length(text, at), 1);
    return characters;
}

// Result: a line for each row. Every column but the last is as wide as its widest cell.
std::string aligned(std::span<const Cells> rows) {
    std::vector<std::size_t> widths;
    for (const Cells& row : rows) {
        widths.resize(std::max(widths.size(), row.size()));
        for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], width_of(row[i]));
    }
    std::string text;
    for (const Cells& row : rows) {
        std::string line;
        for (std::size_t i = 0; i < row.size(); ++i)
            line += row[i] + std::string(i + 1 < row.size() ? widths[i] - width_of(row[i]) + 2 : 0, ' ');
        line.erase(line.find_last_not_of(' ') + 1);
        text += line + "\n";
    }
    return text;
}

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
