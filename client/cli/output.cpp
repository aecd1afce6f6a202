#include "client/cli/output.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>
#include <numbers>

#include "protocol/schema/codec.h"
#include "protocol/schema/cue.pb.h"
#include "protocol/schema/library.pb.h"
#include "protocol/schema/measure.pb.h"
#include "protocol/schema/property.h"
#include "protocol/schema/report.pb.h"
#include "protocol/schema/scene.pb.h"
#include "protocol/schema/state.pb.h"

namespace gonio {
namespace {

using Json = nlohmann::ordered_json;

// A pass of a report says "light": null where the message has none, so that scripts need not tell absent from null.
void add_null_lights(Json& report) {
    if (!report.contains("passes")) return;
    for (Json& pass : report["passes"])
        if (!pass.contains("light")) pass["light"] = nullptr;
}

Json json_of(const google::protobuf::Message& message) {
    Json json = Json::parse(encode_message(Encoding::json, message));
    const std::string& name = message.GetDescriptor()->name();
    if (name == "LuxReport") json.erase("html");
    if (name == "FrameReport") add_null_lights(json);
    if (name == "CaptureResult") {
        json.erase("image");
        if (json.contains("report")) add_null_lights(json["report"]);
    }
    return json;
}

std::string one_line(const Json& json) {
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

// Two spaces a level; what holds only numbers or words stays on its line.
std::string indented(const Json& json, std::size_t level) {
    const bool flat = std::none_of(json.begin(), json.end(), [](const Json& child) { return child.is_structured(); });
    if (!json.is_structured() || json.empty() || (json.is_array() && flat)) return one_line(json);
    std::string text(1, json.is_array() ? '[' : '{');
    for (auto child = json.begin(); child != json.end(); ++child) {
        text += (child == json.begin() ? "\n" : ",\n") + std::string(2 * (level + 1), ' ');
        if (json.is_object()) text += one_line(Json(child.key())) + ": ";
        text += indented(*child, level + 1);
    }
    return text + "\n" + std::string(2 * level, ' ') + (json.is_array() ? ']' : '}');
}

std::string text_of(const Json& json, bool compact) {
    return compact ? one_line(json) : indented(json, 0);
}

// Takes the next step of the path off its front. Result: the child, or null.
const Json* step(const Json& at, std::string_view& path) {
    if (path.starts_with('.')) path.remove_prefix(1);
    std::string_view name;
    if (path.starts_with('[')) {
        const std::size_t close = path.find(']');
        if (close == std::string_view::npos) return nullptr;
        name = path.substr(1, close - 1);
        path.remove_prefix(close + 1);
        std::size_t index = 0;
        const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), index);
        if (at.is_array() && error == std::errc() && end == name.data() + name.size())
            return index < at.size() ? &at[index] : nullptr;
        if (at.is_array())
            for (const Json& element : at)
                if (element.is_object() && element.value("name", "") == name) return &element;
        return nullptr;
    }
    if (at.is_object()) {
        const std::size_t length = std::min(path.find_first_of(".["), path.size());
        const auto found = at.find(std::string(path.substr(0, length)));
        if (found == at.end()) return nullptr;
        path.remove_prefix(length);
        return &*found;
    }
    // A name may itself contain dots: the longest that fits is meant.
    const Json* best = nullptr;
    std::size_t best_length = 0;
    if (at.is_array())
        for (const Json& element : at) {
            const std::string candidate = element.is_object() ? element.value("name", "") : "";
            const bool fits =
                !candidate.empty() && path.starts_with(candidate) && candidate.size() > best_length &&
                (path.size() == candidate.size() || path[candidate.size()] == '.' || path[candidate.size()] == '[');
            if (!fits) continue;
            best = &element;
            best_length = candidate.size();
        }
    path.remove_prefix(best_length);
    return best;
}

}  // namespace

std::string to_json(const google::protobuf::Message& message, bool compact) {
    return text_of(json_of(message), compact);
}

Result<std::string> json_at(const google::protobuf::Message& message, std::string_view path, bool compact) {
    const Json json = json_of(message);
    const Json* at = &json;
    for (std::string_view rest = path; !rest.empty();) {
        const std::string_view before = rest;
        at = step(*at, rest);
        if (!at) return Error{"not_found", std::string(path), std::string(before), "The state has no such part."};
    }
    return text_of(*at, compact);
}

// "[#####...............]  25 %  ", where it is known how much there is.
static std::string bar_of(const v1::Progress& progress) {
    constexpr int kWidth = 20;
    double share = 0;
    if (progress.has_total() && progress.total() > 0)
        share = static_cast<double>(progress.samples()) / progress.total();
    else if (progress.has_seconds_left() && progress.seconds() + progress.seconds_left() > 0)
        share = progress.seconds() / (progress.seconds() + progress.seconds_left());
    else
        return {};
    share = std::clamp(share, 0.0, 1.0);
    const auto full = static_cast<std::size_t>(share * kWidth);
    char percent[16];
    std::snprintf(percent, sizeof percent, "%3.0f %%  ", std::floor(100 * share));
    return "[" + std::string(full, '#') + std::string(kWidth - full, '.') + "] " + percent;
}

std::string progress_line(const v1::Progress& progress) {
    char line[160];
    if (progress.jobs_before() > 0) {
        std::snprintf(line, sizeof line, "waiting: %u %s first", progress.jobs_before(),
                      progress.jobs_before() == 1 ? "job comes" : "jobs come");
        return line;
    }
    std::snprintf(line, sizeof line, "%.0f s  %u", progress.seconds(), progress.samples());
    std::string text = bar_of(progress) + line;
    if (progress.has_total()) text += " of " + std::to_string(progress.total());
    text += " " + (progress.unit().empty() ? "done" : progress.unit());
    if (progress.noise_ratio() > 0) {
        std::snprintf(line, sizeof line, "  noise %.3g %%", 100 * progress.noise_ratio());
        text += line;
    }
    if (progress.has_seconds_left()) {
        const double left = progress.seconds_left();
        std::snprintf(line, sizeof line, "  %.0f %s left",
                      left < 600    ? left
                      : left < 7200 ? left / 60
                                    : left / 3600,
                      left < 600    ? "s"
                      : left < 7200 ? "min"
                                    : "h");
        text += line;
    }
    return text;
}

std::string cue_table(const v1::State& state) {
    const v1::CuePlayback& playback = state.cue_playback();
    std::string text;
    char line[512];
    if (state.cues().cues_size() > 0) {
        std::snprintf(line, sizeof line, "  %8s %-24s %7s %7s %7s %7s %-12s %-11s\n", "cue", "label", "up", "down",
                      "delay", "delay", "goes on", "time code");
        text += line;
    }
    for (const v1::Cue& cue : state.cues().cues()) {
        std::string goes_on;
        if (cue.has_follow_s()) goes_on = "follow " + print_number(cue.follow_s());
        if (cue.has_hang_s()) goes_on = "hang " + print_number(cue.hang_s());
        std::snprintf(line, sizeof line, "%c%c%8s %-24.128s %7g %7g %7g %7g %-12s %-11s",
                      cue.number() == playback.active() ? '*' : ' ', cue.number() == playback.next() ? '>' : ' ',
                      cue.number().c_str(), cue.label().c_str(), cue.up_s(), cue.down_s(), cue.delay_up_s(),
                      cue.delay_down_s(), goes_on.c_str(), cue.timecode().c_str());
        std::string one = line;
        one.erase(one.find_last_not_of(' ') + 1);
        text += one + "\n";
    }
    if (playback.held()) text += "held\n";
    if (playback.running()) {
        std::snprintf(line, sizeof line, "running: %.0f %%, %.1f s left\n", 100 * playback.progress_ratio(),
                      playback.remaining_s());
        text += line;
    }
    if (playback.has_next_in_s()) {
        std::snprintf(line, sizeof line, "the next one starts in %.1f s\n", playback.next_in_s());
        text += line;
    }
    if (playback.chase() != "off")
        text += "time code of " + playback.timecode_source() + ": " + playback.chase() +
                (playback.timecode().empty() ? "" : " " + playback.timecode()) + "\n";
    return text;
}

std::string report_table(const v1::FrameReport& report) {
    char line[512];
    std::snprintf(line, sizeof line, "scene_rev %u  frame_ms %.2f  settled %s\n", report.scene_rev(), report.frame_ms(),
                  report.settled() ? "true" : "false");
    std::string text = line;
    std::snprintf(line, sizeof line, "%-24s %-16s %-7s %5s %9s %9s %6s\n", "pass", "light", "state", "faces", "cpu_ms",
                  "gpu_ms", "draws");
    text += line;
    for (const v1::PassReport& pass : report.passes()) {
        std::snprintf(line, sizeof line, "%-24.64s %-16.128s %-7.16s %5u %9.3f %9.3f %6u\n", pass.name().c_str(),
                      pass.has_light() ? pass.light().c_str() : "-", pass.state().c_str(), pass.faces(), pass.cpu_ms(),
                      pass.gpu_ms(), pass.draws());
        text += line;
    }
    return text;
}

// Result: the angle in plane C0, and after a slash the widest one where that is wider; degrees.
static std::string beam_text(bool known, double rad, double widest_rad) {
    if (!known) return "-";
    char text[64];
    std::snprintf(text, sizeof text, "%.1f", rad * 180.0 / std::numbers::pi);
    const std::size_t length = std::strlen(text);
    if (widest_rad > rad * 1.001)
        std::snprintf(text + length, sizeof text - length, "/%.1f", widest_rad * 180.0 / std::numbers::pi);
    return text;
}

std::string library_table(const v1::Library& library) {
    char line[700];
    std::snprintf(line, sizeof line, "%-32s %9s %9s %11s %11s %6s  %s\n", "name", "lm", "cd", "beam", "field", "W", "");
    std::string text = line;
    for (const v1::LibraryRow& row : library.rows()) {
        const v1::PhotometrySummary& summary = row.summary();
        if (!row.has_summary()) {
            std::snprintf(line, sizeof line, "%-32.128s %9s %9s %11s %11s %6s  not usable: %.300s\n",
                          row.name().c_str(), "-", "-", "-", "-", "-", row.error().c_str());
        } else {
            std::snprintf(line, sizeof line, "%-32.128s %9.0f %9.0f %11s %11s %6.4g  %.300s\n", row.name().c_str(),
                          summary.flux_lm(), read_numbers(summary, "max_cd").front(),
                          beam_text(summary.has_beam_rad(), summary.beam_rad(), summary.widest_beam_rad()).c_str(),
                          beam_text(summary.has_field_rad(), summary.field_rad(), summary.widest_field_rad()).c_str(),
                          summary.input_watts(),
                          (summary.description().empty() ? row.source() : summary.description()).c_str());
        }
        text += line;
    }
    std::snprintf(line, sizeof line, "%d of %u found, %u in all%s\n", library.rows_size(), library.found(),
                  library.total(), library.reading() ? "; folders are being read" : "");
    return text + line;
}

}  // namespace gonio
