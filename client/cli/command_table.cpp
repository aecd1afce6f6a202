// The rows of what is not the scene's: queries, consoles, fader boxes, and gonio's own options.
#include "client/cli/commands.h"
#include "protocol/schema/traced_words.h"
#include "protocol/schema/words.h"

namespace gonio {
namespace {

using enum WordForm;

constexpr WordRow kPath[] = {
    {"[PATH]", "", text, "", "lights[0].aim, lights.NAME.level_ratio, camera.eye; default: all"}};
constexpr WordRow kGetOptions[] = {
    {"--hash", "", flag, "hash", "also the hash of the show: servers with the same show have the same"}};
constexpr WordRow kReportOptions[] = {
    {"--rev", "N", count, "rev", "of the first frame with that scene_rev or a later one; default: the newest"},
    {"--table", "", flag, "", "a line for each pass"},
};
constexpr WordRow kFile[] = {{"[FILE]", "", text, "", "TOML; default: prints what is in force"}};
constexpr WordRow kFileOptions[] = {
    {"--default", "", flag, "", "back to the default: docs/consoles.md, docs/faders.md"},
    {"--none", "", flag, "", "nothing drives anything"},
};
constexpr WordRow kLearn[] = {
    {"[TARGET]", "", text, "",
     "a light, a group, or #1 for the first light; preset: PROPERTY is its name;"
     " cue: PROPERTY is go, back, stop or a number"},
    {"[PROPERTY]", "", text, "", "what the control drives from then on; default: it is only named"},
};
constexpr WordRow kLearnOptions[] = {
    {"--range", "LOW,HIGH", vector, "", "what both ends stand for, in degrees, m, ratios or EV"},
    {"--curve", "NAME", text, "curve", "linear (default), square, cube or s"},
    {"--takeover", "NAME", text, "takeover",
     "pickup or jump; default: jump for motor faders, endless controls, buttons"},
    {"--mode", "NAME", text, "mode", "rate; of buttons toggle (default), flash, set, save"},
    {"--step", "R", number, "step", "-10 to 10: of the range for each click, or a second at full deflection; pages"},
    {"--smooth", "S", number, "smooth_s", "time constant in seconds, 0 to 2"},
    {"--fade", "S", number, "fade_s", "of a preset, seconds, 0 to 3600; default 0"},
    {"--profiles", "A,B,…", names, "profiles", "of the property profile or gel: names that share the range"},
    {"--page", "N", count, "page", "page of the box, 1 to 64; default 0: every page"},
    {"--any-box", "", flag, "", "for every box that has a control of this name"},
    {"--timeout", "S", number, "", "seconds, 0.1 to 600; default 30"},
};
constexpr WordRow kControl[] = {{"CONTROL", "", text, "row.control", "as gonio surfaces lists it: \"slider 3\""}};
constexpr WordRow kForgetOptions[] = {
    {"--box", "BOX", text, "row.device", "as gonio surfaces lists it; default *: any"},
    {"--page", "N", count, "row.page", "1 to 64; default 0: the row of every page"},
};
constexpr WordRow kAcquireOptions[] = {
    {"--take", "", flag, "", "also from a client that has it"},
    {"--hold", "S", number, "", "seconds, 0 to 1e6; default: until interrupted"},
};
constexpr auto kReleaseOptions = std::span(kAcquireOptions).first<1>();
constexpr WordRow kFiles[] = {
    {"FILE…", "", text, "", "IES, EULUMDAT, TM-33 or GLDF, or a zip with one; -: standard input"}};
constexpr WordRow kPhotometryOptions[] = {
    {"--svg", "", flag, "", "an SVG drawing of the curves"},
    {"--ugr", "", flag, "", "CIE 190's table of the unified glare rating too"},
    {"--spacing", "RATIO", number, "",
     "of --ugr: between luminaires, of their height above the eye, 0.1 to 2; default: 0.25"},
    {"--variant", "NAME", text, "", "of a GLDF product, id or name, default: the first; of a zip, a file's name"},
    {"--emitter", "NAME", text, "", "of a GLDF variant or a TM-33 file; default: the first"},
};
constexpr WordRow kConvert[] = {
    {"IN", "", text, "", "as gonio photometry reads it; -: standard input"},
    {"OUT", "", text, "", "its ending says the format: .ies, .ldt, or .xml (TM-33)"},
};
constexpr auto kConvertOptions = std::span(kPhotometryOptions).last<2>();
constexpr WordRow kBake[] = {
    {"SCENE", "", text, "", "cornell, atrium, cylinder, or a .gltf, .glb or .mvr file"},
    {"OUTDIR", "", text, "", "folder of the maps; finished parts in it are taken over"},
    {"[COMMAND…]", "", text, "", "what changes the scene before, each in quotes: \"haze show\""},
};
constexpr WordRow kBakeOptions[] = {
    {"--size", "N", positive_count, "", "texels a side, 16 to 8192; default 1024"},
    {"--texel", "M", number, "", "side of a texel in m; default: as fine as the size holds"},
    {"--uv", "NAME", text, "", "own (default), or second: the file's TEXCOORD_1"},
    {"--directions", "N", positive_count, "", "rays of a texel and bounce, 32 to 65536; default 256"},
    {"--bounces", "N", count, "", "at most, 0 to 64; default 64"},
    {"--tolerance", "R", number, "", "share of all that further bounces may add, 0 to 0.5; default 0.002"},
    {"--openings", "NAME", text, "", "on (default): light comes from luminous openings; off: from points"},
    {"--steps", "N", positive_count, "", "samples of the haze along a ray, 1 to 1024; default 30"},
    {"--steps-form", "NAME", text, "", "equiangular (default), or even"},
    {"--air", "NAME", text, "", "what reaches the haze: volume (default), or rays"},
    {"--format", "NAME", text, "", "of the EXR files: float (default), or half"},
    {"--memory", "MIB", positive_count, "", "that maps and texels may take; default 4096"},
    {"--threads", "N", positive_count, "", "at most 1024; default: one for each processor that it may use"},
    {"--seed", "N", count, "", "of the samples; default 1"},
    {"--scale", "R", number, "", "metres a unit of the scene's file; default 1"},
};
constexpr WordRow kDoctor[] = {
    {"[OPTION…]", "", text, "", "of goniod, behind --: -- --config /etc/goniod/goniod.toml"}};
constexpr WordRow kFrames = {"--frames", "N", count, "", "ends after N frames, N above 0; default: when interrupted"};
constexpr WordRow kWatchOptions[] = {
    kFrames,
    {"--out", "FILE", text, "", "writes the video there, as raw H.264"},
};
constexpr WordRow kRelayOptions[] = {
    {"--rtp", "HOST:PORT", text, "", "sends RTP there, and RTCP to the port after it"},
    {"--rtcp", "PORT", count, "", "of this machine, at which receivers ask for key frames; default: any free one"},
    {"--sdp", "FILE", text, "", "writes there what receivers open the RTP by; default: prints it"},
    {"--annexb", "", flag, "", "writes raw H.264 to standard output"},
    {"--key-every", "S", number, "", "seconds at most between key frames, 0.5 to 60; default 2"},
    kFrames,
};

constexpr WordRow kPlace[] = {
    {"X", "", ratio, "x", "from the picture's left edge, 0 to 1 or 0% to 100%"},
    {"Y", "", ratio, "y", "from its upper edge"},
};

constexpr WordRow kSaveShow[] = {
    {"[NAME]", "", text, "name", "1 to 100 bytes, no path; default: the name that the show has"}};
constexpr WordRow kSaveShowOptions[] = {{"--replace", "", flag, "replace", "also another show of this name"}};
constexpr WordRow kSceneFile[] = {
    {"OUT", "", scene_file, "format", "file to write: .glb (binary glTF) or .mvr (MVR show)"}};
constexpr WordRow kRenameShow[] = {{"NAME", "", text, "name", "as gonio shows lists it"},
                                   {"NEW", "", text, "new_name", "1 to 100 bytes, no path"}};
constexpr WordRow kRemoveShow[] = {{"NAME", "", text, "name", "as gonio shows lists it"}};
constexpr WordRow kOpenShow[] = {{"NAME", "", text, "name", "as gonio shows lists it"}};
constexpr WordRow kOpenShowOptions[] = {
    {"--upload", "", flag, "", "NAME is a file of this machine, which is sent first"}};
constexpr WordRow kShows[] = {{"[NAME]", "", text, "text_of", "prints this show's JSON; default: the list"}};
constexpr WordRow kShowsOptions[] = {{"--now", "", flag, "", "prints the JSON of the show as it stands"}};

constexpr WordRow kSearch[] = {{"[TEXT…]", "", text, "", "words that a name or description has; default: all rows"}};
constexpr WordRow kLibraryOptions[] = {
    {"--min-flux", "LM", number, "min_flux_lm", "lm, 0 or more"},
    {"--max-flux", "LM", number, "max_flux_lm", "lm, 0 or more"},
    {"--min-beam", "DEG", degrees, "min_beam_rad", "full angle of 50 %, 0 to 360"},
    {"--max-beam", "DEG", degrees, "max_beam_rad", "likewise"},
    {"--offset", "N", count, "offset", "rows to leave out"},
    {"--count", "N", positive_count, "count", "rows at most, 1 to 500; default 100"},
    {"--read-again", "", flag, "read_again", "has the server read its folders again; ask once more for what is new"},
};

constexpr WordRow kQuality[] = {
    {"--quality", "NAME", text, "quality", "interactive (default), or reference: path-traced"}};
constexpr WordRow kGridName[] = {{"NAME", "", text, "name", "of a grid"}};
constexpr WordRow kCsv[] = {{"--csv", "", flag, "", "a line for each point"}};
constexpr auto kGridValues = joined(kCsv, kQuality, kTracedOptions);
constexpr WordRow kObserverName[] = {
    {"[OBSERVER]", "", text, "observer", "one that is kept; or --eye and --direction"}};
constexpr WordRow kSight[] = {
    {"--eye", "x,y,z", vector, "eye_m", "m; sitting 1.2 m above the floor, standing 1.6 m"},
    {"--direction", "x,y,z", vector, "direction", "line of sight, usually horizontal"},
};
constexpr auto kUgr = joined(kSight, kQuality, kTracedOptions);
constexpr WordRow kReportFile[] = {{"OUT", "", text, "", "the .html file to write"}};
constexpr WordRow kLuxReport[] = {
    {"--title", "TEXT", text, "title", "at most 200 bytes; default: the show's or the scene's name"},
    {"--bounces", "N", text, "bounces", "all (default), or 0 to 64"},
    {"--noise", "R", ratio, "noise_ratio",
     "of pictures, 0.0005 to 0.5, default 0.05; grids and observers get a quarter of it"},
    {"--max-seconds", "S", number, "max_seconds", "for each part, 0.1 to 86400; default: no end"},
    {"--size", "WxH", size, "width_px", "of the pictures, pixels; default: 960 wide, as the scene's is shaped"},
};

constexpr WordRow kHelp[] = {{"[COMMAND…]", "", text, "", "set light; default: all commands"}};

constexpr WordCommand kCommands[] = {
    {"help", "", "prints all commands, or the options of one", kHelp, {}},
    {"version", "", "prints the version of gonio", {}, {}},
    {"light list", "get_state", "prints a line for each light", {}, {}},
    {"group list", "get_state", "prints a line for each group of lights", {}, {}},
    {"grid list", "get_state", "prints a line for each calculation grid", {}, {}},
    {"grid values", "grid", "reads a calculation grid: mean, minimum, uniformity, checks and values", kGridName,
     kGridValues},
    {"observer list", "get_state", "prints a line for each observer", {}, {}},
    {"ugr", "ugr", "tells the unified glare rating of an observer, and what glares", kObserverName, kUgr},
    {"targets", "targets", "lists the rows of standards that grids and observers can be held against", {}, {}},
    {"lux-report", "lux_report", "writes a page that prints: pictures, grids, luminaires and glare, path-traced",
     kReportFile, kLuxReport},
    {"save show", "save_show", "keeps the show in the server's folder of shows", kSaveShow, kSaveShowOptions},
    {"save scene", "capture", "writes the scene as it stands to a file of this machine", kSceneFile, {}},
    {"open show", "command.open_show", "replaces the scene by a show", kOpenShow, kOpenShowOptions},
    {"show rename", "rename_show", "gives a show in the server's folder another name", kRenameShow, {}},
    {"show remove", "remove_show", "removes a show from the server's folder, for good", kRemoveShow, {}},
    {"shows", "shows", "lists the shows in the server's folder, or prints one", kShows, kShowsOptions},
    {"gels", "gels", "lists the gels that set light --gel takes", {}, {}},
    {"library", "library", "lists the profiles that lights can have by name", kSearch, kLibraryOptions},
    {"pick", "pick", "tells what the picture shows at a place, and its lux and cd/m²", kPlace, {}},
    {"preset list", "get_state", "prints a line for each preset, and which one was recalled last", {}, {}},
    {"cue list", "get_state", "prints a line for each cue: > is the next one, * the active one", {}, {}},
    {"view list", "get_state", "prints a line for each saved view of the camera", {}, {}},
    {"undo", "command.undo", "sets back what the last command changed, of this user on this machine", {}, {}},
    {"redo", "command.redo", "does again what was undone", {}, {}},
    {"report", "report", "tells what a frame ran, and how long", {}, kReportOptions},
    {"stats", "stats", "prints the counters of the server", {}, {}},
    {"sources", "sources", "tells who sends sACN, Art-Net and OSC, and who wins", {}, {}},
    {"patch", "", "prints or replaces which slots drive what", kFile, kFileOptions},
    {"surfaces", "", "prints or replaces what fader boxes drive", kFile, kFileOptions},
    {"learn", "command.map_control.row", "waits for a control that a hand moves; names it or lets it drive PROPERTY",
     kLearn, kLearnOptions},
    {"forget", "command.map_control", "the control drives nothing of its own any more", kControl, kForgetOptions},
    {"control acquire", "", "keeps the camera for this client, until interrupted", {}, kAcquireOptions},
    {"control release", "", "frees the camera for others", {}, kReleaseOptions},
    {"photometry", "", "prints quantities and diagnostics of photometric files, offline", kFiles, kPhotometryOptions},
    {"convert", "", "writes a photometric file in another format, offline", kConvert, kConvertOptions},
    {"bake", "", "bakes irradiance maps of a scene into a folder, offline, by the goniod beside this program", kBake,
     kBakeOptions},
    {"doctor",
     "",
     "says what would keep this machine from working, with the mend for each; asks the goniod beside it",
     kDoctor,
     {}},
    {"watch", "", "prints one JSON line for each change and frame", {}, kWatchOptions},
    {"relay",
     "",
     "passes the frames on as they are, to a media server with many viewers or to another program",
     {},
     kRelayOptions},
};
constexpr WordCommand kGet = {"get", "get_state", "prints the state, or a part of it, as JSON", kPath, kGetOptions};

constexpr WordRow kOptions[] = {
    {"--server", "URL", text, "", "default: $GONIO_SERVER, else http://127.0.0.1:8080"},
    {"--token-file", "FILE", text, "", "bearer token, where the server asks for one"},
    {"--ca", "FILE", text, "", "of https: the authorities to trust instead of the system's (PEM)"},
    {"--role", "ROLE", text, "", "viewer: may look and ask, not change anything"},
    {"--json", "", flag, "", "one line of JSON, also for refusals"},
    {"--help", "", flag, "", "also -h; after a command: what that command takes"},
    {"--version", "", flag, "", "also gonio version"},
};

}  // namespace

std::span<const WordCommand> cli_commands() {
    static const auto all = [] {
        std::vector<WordCommand> commands{kGet};
        commands.insert(commands.end(), scene_commands().begin(), scene_commands().end());
        commands.insert(commands.end(), std::begin(kCommands), std::end(kCommands));
        return commands;
    }();
    return all;
}

std::span<const WordRow> cli_options() {
    return kOptions;
}

ReadWords read_command_line(std::span<const std::string> args) {
    return read_words(args, {cli_commands(), kOptions});
}

}  // namespace gonio
