#include "client/cli/surfaces.h"

#include <cstdio>
#include <set>

#include "protocol/schema/property.h"
#include "protocol/schema/surface.pb.h"
#include "protocol/schema/words.h"
#include "protocol/surface/surface_map.h"

namespace gonio {
namespace {

Error usage(std::string where, std::string value, std::string message) {
    return {"usage", std::move(where), std::move(value), std::move(message)};
}

std::string drives_text(const v1::SurfaceRow& row) {
    std::string text = row.target().empty() ? row.property() : row.target() + " " + row.property();
    if (!row.preset().empty()) text += " " + row.preset();
    if (!row.cue().empty()) text += " " + row.cue();
    if (row.property() == kPageProperty)
        text += row.has_high() ? " " + print_number(row.high()) : row.step() < 0 ? " back" : " on";
    for (const std::string& manner : {row.mode(), row.curve(), row.takeover()})
        if (!manner.empty()) text += ", " + manner;
    const PropertyRow* property = find_property(row.property());
    if (property != nullptr && (row.has_low() || row.has_high()))
        text += ", " + print_number((row.has_low() ? row.low() : property->low) / property->unit) + " to " +
                print_number((row.has_high() ? row.high() : property->high) / property->unit);
    if (row.page() > 0) text += ", page " + std::to_string(row.page());
    return text;
}

// Each row of these that is for the control, and notes it as seen.
std::string rows_of(const google::protobuf::RepeatedPtrField<v1::SurfaceRow>& rows, const std::string& device,
                    const std::string& control, std::set<const v1::SurfaceRow*>& seen) {
    std::string text;
    for (const v1::SurfaceRow& row : rows) {
        if (row.control() != control || !means_box(row.device(), device)) continue;
        seen.insert(&row);
        text += (text.empty() ? "" : "; ") + drives_text(row);
    }
    return text;
}

std::string value_text(const v1::SurfaceControl& control) {
    if (!control.heard()) return "-";
    char text[32];
    std::snprintf(text, sizeof text, control.kind() == "absolute" ? "%.4f" : "%g", control.value());
    return text;
}

}  // namespace

std::string surfaces_table(const v1::Surfaces& surfaces) {
    std::string text;
    char line[512];
    std::set<const v1::SurfaceRow*> seen;
    if (surfaces.devices_size() == 0) text += "no fader box is plugged in, or goniod may not see it (docs/faders.md)\n";
    for (const v1::SurfaceDevice& device : surfaces.devices()) {
        text += device.device() + " " + device.product() + ": " + device.state();
        if (!device.error().empty()) text += ", " + device.error();
        if (device.state() == "live") {
            text += " by " + device.transport();
            if (!device.profile().empty()) text += ", profile " + device.profile();
            text += ", " + std::to_string(device.events()) + " movements";
            if (device.ignored() > 0) text += ", " + std::to_string(device.ignored()) + " messages not understood";
        }
        text += "\n";
        for (const v1::IgnoredMessages& ignored : device.not_understood())
            text += "  not understood: " + std::to_string(ignored.count()) + " x " + ignored.kind() + "\n";
        for (const v1::SurfaceControl& control : device.controls()) {
            std::string drives = rows_of(surfaces.rows(), device.device(), control.name(), seen);
            const std::string own = rows_of(surfaces.default_rows(), device.device(), control.name(), seen);
            if (drives.empty()) drives = own;
            std::snprintf(line, sizeof line, "  %-20.40s %-9s %6u %9s %s ", control.name().c_str(),
                          control.kind().c_str(), control.steps(), value_text(control).c_str(),
                          control.feedback() ? "*" : " ");
            text += line + drives + "\n";
        }
    }
    for (const v1::SurfaceRow& row : surfaces.rows())
        if (!seen.contains(&row))
            text += "not here: " + row.device() + " " + row.control() + " drives " + drives_text(row) + "\n";
    for (const std::string& warning : surfaces.warnings()) text += "warning: " + warning + "\n";
    if (surfaces.page() > 1) text += "page " + std::to_string(surfaces.page()) + "\n";
    if (surfaces.has_latency_ms())
        text += "from the hand to the picture: " + print_number(surfaces.latency_ms()) + " ms (median)\n";
    return text;
}

Result<LearnWords> learn_request(const ReadWords& words) {
    LearnWords request;
    if (words.has("--timeout")) request.timeout_s = *parse_number(words.options.at("--timeout"));
    request.any_box = words.has("--any-box");
    std::vector<double> range;
    if (words.has("--range")) {
        range = *parse_vector(words.options.at("--range"));
        if (range.size() != 2)
            return usage("--range", words.options.at("--range"), "This must be two numbers, like 0,1.");
    }
    if (words.names.empty()) return request;
    v1::SurfaceRow row = words.message.command().map_control().row();
    if (words.names.front() == "preset" && words.names.size() == 2) {
        row.set_property("preset");
        row.set_preset(words.names.back());
    } else if (words.names.front() == "cue" && words.names.size() == 2) {
        row.set_property("cue");
        row.set_cue(words.names.back());
    } else {
        row.set_property(words.names.back());
        if (words.names.size() == 2) row.set_target(words.names.front());
    }
    const PropertyRow* property = find_property(row.property());
    if (property == nullptr && row.property() != kPageProperty)
        return usage("learn", row.property(), "There is no such property.");
    if (!range.empty()) {
        row.set_low(range[0] * (property != nullptr ? property->unit : 1));
        row.set_high(range[1] * (property != nullptr ? property->unit : 1));
    }
    request.row = row;
    return request;
}

}  // namespace gonio
