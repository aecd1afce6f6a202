#include "protocol/schema/words.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <deque>
#include <filesystem>
#include <fstream>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/property.h"
#include "protocol/schema/traced_words.h"

namespace gonio {
namespace {

constexpr std::size_t kMaxProfileBytes = 1u << 20;
constexpr std::size_t kMaxVectorNumbers = 16;

using Words = std::span<const std::string>;
using enum WordForm;

// The rows of a table that is made once, and the text that they view.
struct WordRows {
    std::deque<std::string> texts;
    std::vector<WordRow> rows;
    std::string_view keep(std::string text) { return texts.emplace_back(std::move(text)); }
};

bool is_ratio(const PropertyRow& row) {
    return row.values == 1 && row.least == 0 && row.most == 1;
}

WordForm form_of(const PropertyRow& row) {
    return row.property == Property::color ? color
           : row.values == 3               ? vector
           : row.unit != 1                 ? degrees
           : is_ratio(row)                 ? ratio
                                           : number;
}

// Result: "EV100, -10 to 24": what a value is and what the server takes.
std::string help_of(const PropertyRow& row) {
    std::string text(row.unit == 1 ? row.unit_name : "");
    const auto add = [&](const std::string& more) { text += (text.empty() ? "" : ", ") + more; };
    if (!row.help.empty()) add(std::string(row.help));
    if (row.or_none) add("0 for none");
    if (row.property != Property::aim)
        add((row.values == 3 ? "each " : "") + print_number(row.least / row.unit) + " to " +
            print_number(row.most / row.unit));
    return is_ratio(row) ? text + ", or 0% to 100%" : text;
}

// What can be set of a light, out of the table of properties. prefix: of the message's fields.
WordRows light_rows_of(const std::string& prefix) {
    WordRows made;
    const auto field = [&](std::string_view name) { return made.keep(prefix + std::string(name)); };
    for (const PropertyRow& row : property_table()) {
        if (row.field.empty() || row.component >= 0) continue;
        made.rows.push_back({made.keep("--" + std::string(row.name)), row.metavar, form_of(row), field(row.field),
                             made.keep(help_of(row))});
    }
    made.rows.push_back({"--profile", "FILE", text, field("profile.name"),
                         "IES, EULUMDAT, TM-33 or GLDF file, which is uploaded; or a name that gonio library lists"});
    made.rows.push_back({"--gel", "NAME", text, field("gel"), "one that gonio gels lists: L201; \"\": none"});
    made.rows.push_back(
        {"--opening", "SHAPE", text, field("opening"),
         "\"rect 1.2x0.3\", \"disc 0.4\", \"line 1.5\", \"sphere 0.3\", \"box 1.2x0.3x0.1\", m; point; file: "
         "what the profile says"});
    made.rows.push_back({"--mount", "HOW", text, field("mount"),
                         "recessed: to 1 mm before the surface that it is let into, at most 0.5 m along its light"});
    return made;
}

std::span<const WordRow> light_options() {
    static const WordRows all = light_rows_of("");
    return all.rows;
}

std::span<const WordRow> lights_options() {
    static const WordRows all = light_rows_of("same.");
    return all.rows;
}

std::span<const WordRow> new_light_options() {
    static const WordRows all = [] {
        WordRows made = light_rows_of("light.");
        made.rows.push_back({"--like", "LIGHT", text, "like", "a light that it takes all else from; or --profile"});
        made.rows.push_back({"--multiplier", "M", number, "multiplier",
                             "of all its candela, 0 to 1e9; default: that of --like, else 1"});
        return made;
    }();
    return all.rows;
}

constexpr WordRow kCameraOptions[] = {
    {"--eye", "x,y,z", vector, "eye_m", "m, each -1e6 to 1e6"},
    {"--target", "x,y,z", vector, "target_m", "m, each -1e6 to 1e6; what it looks at"},
    {"--fov", "DEG", degrees, "fov_rad", "vertical, 1.15 to 171.8"},
};
constexpr WordRow kSetLight[] = {{"NAME", "", text, "name", "of a light, or of a group for every light in it"}};
constexpr WordRow kSetLights[] = {{"NAME…", "", text, "names", "of lights, or of groups for every light in them"}};
constexpr WordRow kRemoveLights[] = {{"NAME…", "", text, "remove", "of lights"}};
constexpr WordRow kAddLight[] = {{"NAME", "", text, "light.name", "that no light has, 1 to 128 bytes"}};

constexpr WordRow kSize[] = {{"WxH", "", size, "width_px", "pixels, even, 16 to 4096 each"}};
constexpr WordRow kScene[] = {
    {"FILE", "", text, "file", "cornell, atrium, or a .gltf, .glb or .mvr on the server's machine"}};
constexpr WordRow kSceneOptions[] = {
    {"--upload", "", flag, "", "sends FILE, of this machine, to the server first"},
    {"--scale", "S", number, "scale", "metres a unit of FILE, 1e-6 to 1e6; default 1. Candela stay"},
    {"--universe-offset", "N", whole, "universe_offset",
     "added to the universes of an MVR file, -63998 to 63998; default 0"},
    {"--keep", "A,B,…", names, "keep", "of the scene before: lights, cues, views, grids"},
    {"--merge", "", flag, "merge", "FILE is the next edition of the scene's MVR show: the show stays"},
    {"--dry-run", "", flag, "dry_run", "with --merge: says what would change, and changes nothing"},
};
constexpr WordRow kTechnique[] = {{"NAME", "", text, "technique", "default, seed or seed-disk"}};
constexpr WordRow kTechniqueOptions[] = {
    {"--samples", "N", count, "samples", "default: VPLs, 16 to 4096; seed: directions a fragment, 1 to 4096"},
};
constexpr WordRow kView[] = {
    {"NAME", "", text, "view", "beauty direct indirect illuminance luminance mask rsm-depth rsm-normal rsm-flux solid"},
};
constexpr WordRow kViewOptions[] = {
    {"--gain", "G", number, "gain", "of indirect, 0.01 to 1000; default 1"},
    {"--light", "LIGHT", text, "light", "of mask, rsm-… and solid; default: the first"},
    {"--range", "LOW:HIGH", range, "range_low",
     "of illuminance in lx or luminance in cd/m², 0 to 1e9; auto: follows the picture where it rests"},
    {"--scale", "NAME", text, "scale", "of colours: log (default) or linear"},
    {"--steps", "N", count, "steps", "of colours, 2 to 27; 0 (default): smooth"},
    {"--palette", "NAME", text, "palette", "classic (default), viridis, spectral or gray"},
    {"--isolux", "on|off", on_or_off, "isolux", "lines at the borders of the steps, or at 1-2-5 of each decade"},
    {"--levels", "A,B,…", vector_or_auto, "levels.values",
     "isolux lines at up to 16 values in lx or cd/m², above 0 to 1e9; auto (default): as --isolux says"},
    {"--below", "VALUE", number, "below", "marks what is less, in lx or cd/m²; 0 (default): nothing"},
    {"--only", "LIGHT", text, "only", "illuminance, luminance: what this light contributes; \"\": all"},
    {"--compare", "PRESET", text, "compare", "illuminance, luminance: the difference from a preset; \"\": none"},
    {"--compare-range", "VALUE", number, "compare_range",
     "the difference is shown from -VALUE to VALUE; default 500 lx, 50 cd/m²"},
};
constexpr WordRow kExposureOptions[] = {
    {"--aperture", "N", number, "aperture", "f-number, 0.5 to 128; with --shutter and --iso in place of EV"},
    {"--shutter", "S", seconds, "shutter_s", "seconds, like 1/60; 1e-6 to 3600"},
    {"--iso", "ISO", number, "iso", "1 to 1e7"},
};
constexpr WordRow kLookOptions[] = {
    {"--tone", "NAME", text, "tone", "the tone curve: knee (default), linear, aces, agx or neutral"},
    {"--white", "K", number, "white_k", "what is white, 1000 to 15000 K; 0 (default): D65, 6504 K"},
    {"--tint", "DUV", number, "white_duv", "that white off the Planckian locus, -0.05 to 0.05; default 0"},
};
constexpr WordRow kWorkLight[] = {{"ON", "", on_or_off, "work_light", "on or off"}};
constexpr WordRow kLightName[] = {{"NAME", "", text, "name", "of a light"}};
constexpr WordRow kRecess[] = {{"NAME", "", text, "name", "of a light or a group"}};
constexpr WordRow kRename[] = {
    {"NAME", "", text, "name", "of a light"},
    {"NEW", "", text, "new_name", "that no light and no group has, 1 to 128 bytes"},
};
constexpr WordRow kGroup[] = {
    {"NAME", "", text, "name", "of the group"},
    {"[LIGHT…]", "", text, "lights", "all that are in it; none: the group is removed"},
};
constexpr WordRow kPreset[] = {{"NAME", "", text, "name", "of the preset, 1 to 128 bytes"}};
constexpr WordRow kRecallOptions[] = {{"--fade", "S", number, "fade_s", "seconds, 0 to 3600; default 0"}};
constexpr WordRow kCue[] = {{"NUMBER", "", text, "number", "0.001 to 9999.999, at most three decimals"}};
constexpr WordRow kCueTime[] = {
    {"--time", "S", number, "time_s", "seconds, 0 to 3600, instead of the cue's own times and delays"}};
constexpr WordRow kBackTime[] = {{"--time", "S", number, "time_s", "seconds, 0 to 3600; default: cue options --back"}};
constexpr WordRow kAddCue[] = {
    {"--label", "TEXT", text, "label", "at most 128 bytes"},
    {"--up", "S", number, "up_s", "of levels that rise and all that is no level, seconds, 0 to 3600; default 5"},
    {"--down", "S", number, "down_s", "of levels that fall, seconds, 0 to 3600; default: as --up"},
    {"--delay-up", "S", number, "delay_up_s", "before --up begins, seconds, 0 to 3600; default 0"},
    {"--delay-down", "S", number, "delay_down_s", "likewise"},
    {"--follow", "S", number, "follow_s", "starts the next cue so long after this one's start, 0 to 3600"},
    {"--hang", "S", number, "hang_s", "likewise after this one's end; not with --follow"},
    {"--timecode", "HH:MM:SS:FF", text, "timecode", "that starts it; \"\": none"},
    {"--preset", "NAME", text, "preset", "whose content it takes; default: the lights as they are"},
};
constexpr WordRow kSetCue[] = {
    {"--label", "TEXT", text, "label", "at most 128 bytes"},
    {"--up", "S", number, "up_s", "of levels that rise and all that is no level, seconds, 0 to 3600"},
    {"--down", "S", number, "down_s", "of levels that fall, seconds, 0 to 3600"},
    {"--delay-up", "S", number, "delay_up_s", "before --up begins, seconds, 0 to 3600"},
    {"--delay-down", "S", number, "delay_down_s", "likewise"},
    {"--follow", "S", number, "follow_s", "starts the next cue so long after this one's start, 0 to 3600"},
    {"--hang", "S", number, "hang_s", "likewise after this one's end; not with --follow"},
    {"--manual", "", flag, "manual", "neither follow nor hang any more"},
    {"--timecode", "HH:MM:SS:FF", text, "timecode", "that starts it; \"\": none"},
    {"--preset", "NAME", text, "preset", "whose content it takes"},
    {"--record", "", flag, "record", "takes the lights as they are"},
};
constexpr WordRow kCueOptions[] = {
    {"--next", "NUMBER", text, "next", "the cue that GO starts"},
    {"--guard", "S", number, "guard_s", "a GO so soon after another is refused, 0 to 5; default 0.2"},
    {"--back", "S", number, "back_s", "the time of BACK, 0 to 3600; default 1"},
    {"--timecode", "SOURCE", text, "timecode", "that starts cues: off (default), mtc or artnet"},
    {"--freewheel", "S", number, "freewheel_s", "how long time goes on when time code ends, 0.5 to 2; default 1"},
};
constexpr WordRow kSavedView[] = {{"NAME", "", text, "name", "of the view, 1 to 128 bytes"}};
constexpr WordRow kSaveViewOptions[] = {
    {"--eye", "x,y,z", vector, "eye_m", "m, each -1e6 to 1e6; default, as of the others: as the camera is"},
    {"--target", "x,y,z", vector, "target_m", "m, each -1e6 to 1e6; what it looks at"},
    {"--fov", "DEG", degrees, "fov_rad", "vertical, 1.15 to 171.8"},
};
constexpr WordRow kMeterPlace[] = {
    {"--point", "x,y,z", vector, "point_m", "m, each -1e6 to 1e6"},
    {"--normal", "x,y,z", vector, "normal", "of any length but 0"},
    {"--quality", "NAME", text, "quality", "interactive (default), rsm, or reference: path-traced"},
};
constexpr WordRow kMeterGrid[] = {
    {"--u", "x,y,z", vector, "u_m", "m; an edge of a grid's rectangle, from the point"},
    {"--v", "x,y,z", vector, "v_m", "m; the other edge"},
    {"--count", "NUxNV", size, "count", "cells of the grid along u and v, at most 4096 in all; read at their centres"},
};
constexpr auto kMeterOptions = joined(kMeterPlace, kTracedOptions, kMeterGrid);
constexpr WordRow kGrid[] = {
    {"NAME", "", text, "grid.name", "of the grid, 1 to 128 bytes; one of this name is replaced"}};
constexpr WordRow kGridOptions[] = {
    {"--corner", "x,y,z", vector, "grid.corner_m", "m; a corner of the rectangle"},
    {"--u", "x,y,z", vector, "grid.u_m", "m; an edge from that corner, 0.01 to 1000 m long"},
    {"--v", "x,y,z", vector, "grid.v_m", "m; the other edge, at a right angle"},
    {"--quantity", "NAME", text, "grid.quantity",
     "plane (default: on the rectangle), horizontal, vertical, camera, cylindrical, cylindrical-4, semi-cylindrical"},
    {"--direction", "x,y,z", vector, "grid.direction",
     "that vertical and semi-cylindrical face; of plane the side that is read, default: the upper one"},
    {"--view", "NAME", text, "grid.view", "of camera: a saved view; default: the camera as it is"},
    {"--spacing", "NAME", text, "grid.spacing", "nearest (default) or up: how numbers of points are rounded"},
    {"--count", "NUxNV", size, "grid.count", "points along u and v instead of the standard's, at most 4096 in all"},
    {"--margin", "M", number, "grid.margin_m", "m; a band along the edges that is left out; default 0"},
    {"--factor", "R", ratio, "grid.maintenance_factor", "maintenance factor, above 0 to 1; default 1"},
    {"--target", "NAME", text, "grid.target.name", "a row of gonio targets; or a name for values of your own"},
    {"--target-em", "LX", number, "grid.target.em_lx", "lx; least mean illuminance"},
    {"--target-u0", "R", ratio, "grid.target.u0_ratio", "least uniformity, minimum / mean"},
    {"--target-ez", "LX", number, "grid.target.ez_lx", "lx; least mean cylindrical illuminance"},
};
constexpr WordRow kGridName[] = {{"NAME", "", text, "name", "of a grid"}};
constexpr WordRow kObserver[] = {
    {"NAME", "", text, "observer.name", "of the observer, 1 to 128 bytes; one of this name is replaced"}};
constexpr WordRow kObserverOptions[] = {
    {"--eye", "x,y,z", vector, "observer.eye_m", "m; sitting 1.2 m above the floor, standing 1.6 m"},
    {"--direction", "x,y,z", vector, "observer.direction", "line of sight, usually horizontal"},
    {"--target", "NAME", text, "observer.target.name", "a row of gonio targets with a UGR limit; or a name"},
    {"--target-ugr", "UGR", number, "observer.target.ugr", "greatest unified glare rating, 0 to 40"},
};
constexpr WordRow kObserverName[] = {{"NAME", "", text, "name", "of an observer"}};
constexpr WordRow kHaze[] = {{"[PRESET]", "", text, "preset", "off, faint (0.003 /m), show (0.01) or fog (0.1)"}};
constexpr WordRow kHazeOptions[] = {
    {"--extinction", "1/M", number, "extinction_per_m", "1/m at the floor, 0 to 10: absorbed and scattered"},
    {"--albedo", "R", ratio, "albedo", "of that what is scattered, 0 to 1"},
    {"--g", "R", number, "g", "mean cosine of what is scattered, -0.95 to 0.95; above 0: forwards"},
    {"--layer-height", "M", number, "layer_height_m",
     "m above the floor where it is e times thinner; 0: everywhere the same"},
};
constexpr WordRow kPicture[] = {{"OUT", "", picture, "format", "file to write: .png, .jpg or .exr (float values)"}};
constexpr WordRow kCaptureOptions[] = {
    {"--view", "NAME", text, "view", "one of set view; default: the one that is shown"},
    {"--size", "WxH", size, "width_px", "pixels, 1 to 4096 each; default: as shown"},
    {"--quality", "NAME", text, "quality",
     "interactive (default); reference: beauty direct indirect illuminance luminance"},
    {"--bounces", "N", text, "bounces", "all (default), 0 or 1; reference: up to 64"},
    {"--noise", "R", ratio, "noise_ratio",
     "reference: ends at this standard error, 0.0005 to 0.5 of the mean; default 0.02, with --denoise 0.15"},
    {"--max-seconds", "S", number, "max_seconds",
     "reference: ends then with what it has, 0.1 to 86400; default: no end"},
    {"--denoise", "", flag, "denoise", "reference, beauty: fewer samples and a filter; to look at, not to measure"},
    {"--openings", "", flag, "openings", "has no effect: luminaires always emit from their luminous openings"},
    {"--samples-per-pixel", "N", edge_samples, "samples_per_pixel",
     "of edges, 1 to 64; default 16; 1: centres of pixels"},
    {"--legend", "", flag, "legend",
     "png, jpg of illuminance, luminance: the scale and the figures of lines are drawn in"},
    {"--after-rev", "N", count, "after_rev", "of the scene when it has reached that revision, waited for up to 30 s"},
};

}  // namespace

std::span<const WordCommand> scene_commands() {
    static const std::string exposure_help = help_of(row_of(Property::exposure)) + "; auto: metered",
                             master_help = help_of(row_of(Property::master));
    static const WordRow exposure[] = {{"[EV]", "", number_or_auto, "ev100", exposure_help}};
    static const WordRow master[] = {{"RATIO", "", ratio, "ratio", master_help}};
    static const WordCommand all[] = {
        {"load scene", "command.load_scene", "loads another scene", kScene, kSceneOptions},
        {"set light", "command.set_light", "changes a light; what no option names stays", kSetLight, light_options()},
        {"set lights", "command.edit_lights", "changes many lights at once, all or none of them", kSetLights,
         lights_options()},
        {"set camera", "command.set_camera", "moves the camera", {}, kCameraOptions},
        {"set exposure", "command.set_exposure", "sets the exposure", exposure, kExposureOptions},
        {"set look", "command.set_look", "chooses how exposed light becomes a picture", {}, kLookOptions},
        {"set haze", "command.set_haze", "fills the air with haze, which absorbs and scatters light", kHaze,
         kHazeOptions},
        {"set master", "command.set_master", "dims all lights", master, {}},
        {"set view", "command.set_view", "chooses what the picture shows", kView, kViewOptions},
        {"set work-light",
         "command.set_view",
         "whether a picture without any light is shaded towards the camera; meters never are",
         kWorkLight,
         {}},
        {"set size", "command.set_size", "sets the size of the picture", kSize, {}},
        {"set technique", "command.set_technique", "chooses how indirect light is computed", kTechnique,
         kTechniqueOptions},
        {"add light", "command.add_light", "adds a light, of a profile or like another one", kAddLight,
         new_light_options()},
        {"remove lights", "command.edit_lights", "removes many lights at once", kRemoveLights, {}},
        {"remove light", "command.remove_light", "removes a light", kLightName, {}},
        {"recess light",
         "command.recess_light",
         "moves a light along its light to 1 mm before the surface that it is let into, at most 0.5 m",
         kRecess,
         {}},
        {"rename light", "command.rename_light", "gives a light another name; what names it follows", kRename, {}},
        {"group", "command.set_group", "makes, changes or removes a group of lights", kGroup, {}},
        {"preset save",
         "command.save_preset",
         "keeps level, colour, white, gel, shutter, strobe, zoom, gobo, aim, position, profile and opening of all "
         "lights",
         kPreset,
         {}},
        {"preset recall", "command.recall_preset", "brings back what a preset keeps", kPreset, kRecallOptions},
        {"preset remove", "command.remove_preset", "forgets a preset", kPreset, {}},
        {"cue go", "command.cue_go", "starts the next cue, or goes on with one that STOP holds", {}, {}},
        {"cue back", "command.cue_back", "goes to the cue before the active one", {}, kBackTime},
        {"cue stop", "command.cue_stop", "holds the cue that runs; once more: goes to the one before", {}, {}},
        {"cue goto", "command.cue_goto", "goes to a cue", kCue, kCueTime},
        {"cue assert", "command.cue_assert", "brings the active cue about again", {}, kCueTime},
        {"cue add", "command.add_cue", "adds a cue; it keeps what a preset keeps", kCue, kAddCue},
        {"cue set", "command.set_cue", "changes a cue; what no option names stays", kCue, kSetCue},
        {"cue remove", "command.remove_cue", "takes a cue off the list", kCue, {}},
        {"cue options",
         "command.set_cue_options",
         "how the list is played; what no option names stays",
         {},
         kCueOptions},
        {"view save", "command.save_view", "keeps where the camera is", kSavedView, kSaveViewOptions},
        {"view recall", "command.recall_view", "moves the camera to a saved view", kSavedView, {}},
        {"view remove", "command.remove_view", "forgets a saved view", kSavedView, {}},
        {"grid add", "command.set_grid", "keeps a calculation grid", kGrid, kGridOptions, {"--corner", "--u"}},
        {"grid remove", "command.remove_grid", "forgets a calculation grid", kGridName, {}},
        {"observer add",
         "command.set_observer",
         "keeps an observer whose glare is rated",
         kObserver,
         kObserverOptions,
         {"--eye", "--direction"}},
        {"observer remove", "command.remove_observer", "forgets an observer", kObserverName, {}},
        {"meter",
         "meter",
         "measures illuminance in lux and its standard error",
         {},
         kMeterOptions,
         {"--point", "--normal"}},
        {"capture", "capture", "writes a picture to a file", kPicture, kCaptureOptions},
    };
    return all;
}

Result<v1::Command> command_from_words(Words words) {
    const ReadWords read = read_words(words, {scene_commands(), {}, "set"});
    if (read.fault) return *read.fault;
    if (!read.message.has_command()) return Error{"usage", "", words.front(), "This command changes no scene."};
    if (read.has("--upload")) return Error{"usage", "--upload", "", "There is no such option here."};
    return read.message.command();
}

std::optional<double> parse_number(std::string_view text) {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error == std::errc::result_out_of_range && end == text.data() + text.size())
        return text.starts_with('-') ? -HUGE_VAL : HUGE_VAL;  // 1e999: a number that the server refuses
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
}

std::optional<std::uint32_t> parse_count(std::string_view text) {
    std::uint32_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
}

std::optional<std::vector<double>> parse_vector(std::string_view text) {
    std::vector<double> numbers;
    for (;;) {
        const std::size_t comma = std::min(text.find(','), text.size());
        std::string_view part = text.substr(0, comma);
        while (part.starts_with(' ')) part.remove_prefix(1);
        while (part.ends_with(' ')) part.remove_suffix(1);
        const auto number = parse_number(part);
        if (!number || numbers.size() == kMaxVectorNumbers) return std::nullopt;
        numbers.push_back(*number);
        if (comma == text.size()) return numbers;
        text.remove_prefix(comma + 1);
    }
}

std::optional<std::pair<std::uint32_t, std::uint32_t>> parse_size(std::string_view text) {
    const std::size_t cross = text.find('x');
    if (cross == std::string_view::npos) return std::nullopt;
    const auto width = parse_count(text.substr(0, cross)), height = parse_count(text.substr(cross + 1));
    if (!width || !height) return std::nullopt;
    return std::pair{*width, *height};
}

static std::string small_extension(const std::string& file) {
    std::string extension = std::filesystem::path(file).extension().string();
    for (char& c : extension) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    return extension;
}

std::optional<std::string> capture_format(const std::string& file) {
    std::string extension = small_extension(file);
    if (extension == ".jpeg") extension = ".jpg";
    for (const char* known : {".png", ".jpg", ".exr"})
        if (extension == known) return extension.substr(1);
    return std::nullopt;
}

std::optional<std::string> scene_format(const std::string& file) {
    const std::string extension = small_extension(file);
    return extension == ".glb" || extension == ".mvr" ? std::optional(extension.substr(1)) : std::nullopt;
}

Result<bool> attach_profile_file(v1::Command& command) {
    v1::SetLight* light = command.has_set_light()   ? command.mutable_set_light()
                          : command.has_add_light() ? command.mutable_add_light()->mutable_light()
                          : command.has_edit_lights() && command.edit_lights().has_same()
                              ? command.mutable_edit_lights()->mutable_same()
                              : nullptr;
    if (!light || !light->has_profile()) return false;
    const std::filesystem::path path(light->profile().name());
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error)) return false;
    std::ifstream file(path, std::ios::binary);
    std::string bytes(kMaxProfileBytes + 1, '\0');
    file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    if (file.bad() || !file.is_open())
        return Error{"file_unreadable", "--profile", path.string(), "The file cannot be read."};
    bytes.resize(static_cast<std::size_t>(file.gcount()));
    light->mutable_profile()->set_name(path.filename().string());
    *light->mutable_profile()->mutable_photometry() = std::move(bytes);
    return true;
}

}  // namespace gonio
