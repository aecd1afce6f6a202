#include "server/app/options.h"

#include <CLI/CLI.hpp>
#include <cctype>
#include <cstdio>
#include <iostream>
#include <utility>

#include "client/connection/connection.h"
#include "protocol/dmx/artnet.h"
#include "protocol/dmx/e131.h"
#include "server/app/config.h"
#include "server/app/dump_options.h"
#include "server/app/http_options.h"
#include "server/app/option_checks.h"
#include "server/base/threads.h"
#include "server/stream/lanes.h"

namespace gonio {
namespace {

constexpr int kUsage = 2, kBadConfig = 78;  // EX_CONFIG
constexpr unsigned kMinVpls = 16, kMaxSamples = 4096;

void parse(CLI::App& app, const std::vector<std::string>& arguments) {
    app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));  // CLI11 takes them from the back
}

void print_lines(const std::vector<std::string>& lines, const char* what) {
    for (const std::string& line : lines) std::cerr << "goniod: " << what << line << "\n";
}

// default takes 16 samples and more; which technique a saved show has is known when it is read.
std::vector<OptionFault> check_samples(const Options& options) {
    const bool is_default = options.technique == "default" && (options.technique_given || options.state_file.empty());
    if (!is_default || options.samples.value_or(kMinVpls) >= kMinVpls) return {};
    return {{{"samples", "technique"},
             "--samples must be 16..4096 for --technique default, not " + std::to_string(*options.samples)}};
}

// What a follower takes from its leader, or would write.
constexpr const char* kOfLeader[] = {
    "scene",       "scale",          "universe-offset", "technique",  "samples", "size",           "patch", "state",
    "surface-map", "surface-replay", "shows",           "gels",       "sacn",    "artnet",         "osc",   "box",
    "oneshot",     "bake",           "library",         "scene-root", "osc-eos", "ignore-preview", "midi"};

std::vector<OptionFault> check_follow(const Options& options) {
    if (options.follow.empty()) {
        if (options.follow_token_file.empty() && options.follow_ca.empty()) return {};
        return {{{"follow-token-file", "follow-ca"}, "--follow-token-file and --follow-ca go with --follow"}};
    }
    std::vector<OptionFault> faults;
    if (const auto leader = parse_server_url(options.follow); !leader)
        faults.push_back({{"follow"}, "--follow " + options.follow + ": " + leader.error().message});
    for (const std::string& name : options.beside_follow)
        faults.push_back({{name}, "--" + name + " does not go with --follow: " + options.follow + " says it"});
    if (const auto token = token_of_file(options.follow_token_file, nullptr, "--follow-token-file"); !token)
        faults.push_back({{"follow-token-file"}, token.error().text()});
    if (options.limits.upload_bytes == 0)
        faults.push_back({{"max-upload-mib"}, "--follow needs --max-upload-mib above 0: that bounds what it fetches"});
    return faults;
}

// Result: the fault, behind the lines and variables that its options came from.
std::string placed(const OptionFault& fault, const Settings& settings) {
    std::string places;
    for (const std::string& name : fault.options)
        if (const auto source = settings.sources.find(name); source != settings.sources.end())
            places += (places.empty() ? "" : ", ") + source->second;
    return places.empty() ? fault.text : places + ": " + fault.text;
}

// Options whose text becomes something else, and those that are of the command line alone.
struct OptionTexts {
    std::string listen = "127.0.0.1:8080", size = "800x800", sacn, artnet, osc, surfaces = "on", config_file,
                unlit = "albedo", backfaces = "cull";
    unsigned samples = 0;
    bool ignore_preview = false, check_config = false, print_config = false, print_gltf = false, doctor = false,
         dump_options = false;
};

void add_own_options(CLI::App& app, OptionTexts& text) {
    app.set_version_flag("--version", "goniod " GONIO_VERSION)->configurable(false);
    app.add_option("--config", text.config_file, "TOML file of options, a name without its dashes = a value a line")
        ->configurable(false);
    app.add_flag("--check-config", text.check_config, "say what is wrong with options, file and variables, and end")
        ->configurable(false);
    app.add_flag("--print-config", text.print_config,
                 "print the options as they are, with where each came from, and end")
        ->configurable(false);
    app.add_flag("--print-gltf", text.print_gltf, "print what is made of glTF files (docs/gltf.md), and end")
        ->configurable(false);
    app.add_flag("--doctor", text.doctor,
                 "say what would keep this machine from working, with the mend for each, and end; 1: something does")
        ->configurable(false);
    app.add_flag("--dump-options", text.dump_options, "the options as JSON, for packaging/option_texts.py")
        ->configurable(false)
        ->group("");
    app.get_help_ptr()->configurable(false);
}

void add_picture_options(CLI::App& app, Options& options, OptionTexts& text) {
    app.add_option("--scene", options.scene, "cornell, atrium, cylinder, or a .gltf, .glb or .mvr file")
        ->check(check_scene);
    app.add_option(
           "--backfaces", text.backfaces,
           "of one-sided surfaces: cull (viewers look through them, as glTF says), show; they stop light anyway")
        ->check(CLI::IsMember({"cull", "show"}));
    app.add_option("--unlit", text.unlit,
                   "what KHR_materials_unlit is in scene files: albedo, or emission of 80 cd/m² at white")
        ->check(CLI::IsMember({"albedo", "emission"}));
    app.add_option("--scale", options.load.scale,
                   "metres a unit of --scene: 0.01 of a file in centimetres; candela stay")
        ->check(finite_in(kLeastScale, kMostScale));
    app.add_option("--universe-offset", options.load.universe_offset,
                   "added to the universes that the fixtures of an MVR file have as --scene")
        ->check(CLI::Range(-kMostUniverseOffset, kMostUniverseOffset));
    app.add_option("--listen", text.listen, "HOST:PORT; port 0 picks a free one")->check(check_listen);
    app.add_option("--token-file", options.token_file, "file that holds the bearer token clients must show");
    app.add_option("--viewer-token-file", options.viewer_token_file,
                   "file that holds another token: whoever shows it may look and ask, not change or upload anything");
    app.add_option("--device", options.device, "index of the EGL device; default: the first that works");
    app.add_option("--renderer", options.renderer, "gl; null: grey pictures without GL, for tests")
        ->check(CLI::IsMember({"gl", "null"}))
        ->group("");
    app.add_option("--technique", options.technique, "default, seed or seed-disk")
        ->check(CLI::IsMember({"default", "seed", "seed-disk"}));
    app.add_option("--samples", text.samples, "VPLs of default (16..4096), directions per fragment of seed (1..4096)")
        ->check(CLI::Range(1U, kMaxSamples))
        ->default_str("");
    app.add_option("--size", text.size, "WIDTHxHEIGHT of the picture, even, 16..4096")->check(check_size);
    app.add_option("--target-fps", options.target_fps,
                   "frames a second: never more, and while something moves no fewer: pictures get smaller and coarser")
        ->check(finite_in(1, 1000));
    app.add_option(
           "--encoder", options.encoder,
           "of the video: nvenc, vaapi, libx264; auto: the first that works; mjpeg: no H.264, MJPEG and stills alone")
        ->check(CLI::IsMember({"auto", "nvenc", "vaapi", "libx264", "mjpeg"}));
    app.add_option("--max-private-lanes", options.max_private_lanes,
                   "viewers that get an encoder of their own, fitted to their link; all others share one; 0..64")
        ->check(CLI::Range(0U, kMostPrivateLanes));
    app.add_option(
           "--direct-light,--gather", options.direct_light,
           "how direct light finds shadows: gl (shadow maps), rays (of the CPU), auto; before: --gather gl|simd")
        ->transform(CLI::Transformer(std::map<std::string, std::string>{{"simd", "rays"}}))
        ->check(CLI::IsMember({"auto", "gl", "rays"}));
    app.add_option("--oneshot", options.oneshot, "JOB.json: capture its frames and end, without a network")
        ->check(check_file_if_any);
    app.add_option("--out", options.out, "folder for the captures of --oneshot and the maps of --bake");
    app.add_option("--shard", options.shard, "i/n: of a job those frames whose number leaves i when divided by n")
        ->check(check_shard);
    app.add_option("--threads", options.threads,
                   "of rendering, tracing and baking; 0: one for each processor it may use")
        ->check(CLI::Range(0, kMostThreads));
    app.add_option("--isa", options.isa, "instruction set of rays and lighting: avx2, avx512, auto: the machine's best")
        ->check(CLI::IsMember({"auto", "avx2", "avx512"}));
    app.add_flag("--json", options.json, "of a sequence: lines of JSON on stdout, also on a terminal");
    app.add_flag("--gl-debug", options.gl_debug, "count and print GL debug messages");
}

void add_input_options(CLI::App& app, Options& options, OptionTexts& text) {
    app.add_option("--sacn", text.sacn, "listen for sACN on ADDRESS[:5568]; 0.0.0.0: all interfaces. Default: off")
        ->check(check_udp_address);
    app.add_option("--artnet", text.artnet, "listen for Art-Net on ADDRESS[:6454], likewise")->check(check_udp_address);
    app.add_option("--osc", text.osc, "listen for OSC on ADDRESS[:9000], UDP and TCP, likewise")
        ->check(check_udp_address);
    app.add_flag("--osc-eos", options.inputs.osc_eos,
                 "OSC understands and says what Eos does of cues (docs/consoles.md)");
    app.add_flag("--ignore-preview", text.ignore_preview, "leave out sACN packets with the preview bit");
    app.add_option("--patch", options.patch_file, "PATCH.toml: which slots drive what (docs/consoles.md)")
        ->check(check_file_if_any);
    app.add_option("--surfaces", text.surfaces, "on: use fader boxes that are plugged in (docs/faders.md); off")
        ->check(CLI::IsMember({"on", "off"}));
    app.add_option("--box", options.boxes,
                   "VVVV:PPPP: a device that is a fader box though it is not known as one; =FILE gives it a profile")
        ->check(check_box);
    app.add_option("--midi", options.midi, "how MIDI boxes are reached: usb (libusb), alsa, auto")
        ->check(CLI::IsMember({"auto", "usb", "alsa"}));
    app.add_option("--surface-map", options.surface_map, "MAP.toml: what the controls of fader boxes drive")
        ->check(check_file_if_any);
    app.add_option("--surface-replay", options.surface_replay, "FILE: a recorded box, beside those that are plugged in")
        ->check(check_file_if_any);
    app.add_option("--state", options.state_file,
                   "FILE: the show is saved there when it changes and restored at the start; default: none");
    app.add_option(
           "--shows", options.show_folder,
           "folder that clients save shows to and open them from; default: shows beside the --state file, or none")
        ->check(check_upload_folder);
    app.add_option("--gels", options.gel_file, "GELS.csv: colour filters beside the built-in ones (docs/gels.md)")
        ->check(check_file_if_any);
    app.add_option("--follow", options.follow,
                   "URL of another goniod: shows what that one shows, and refuses all changes (docs/followers.md)")
        ->check([](const std::string& url) { return url.empty() ? "needs the URL of a goniod" : ""; });
    app.add_option("--follow-token-file", options.follow_token_file,
                   "file that holds the token which that one asks for; its viewers' is enough");
    app.add_option("--follow-ca", options.follow_ca, "of https: the authorities to trust instead of the system's (PEM)")
        ->check(check_file_if_any);
    app.add_option("--inject", options.inject,
                   "a fault, for tests: gl-loss-after=N, gl-loss-every=N, gl-rebuild-fails=N")
        ->group("");
}

// Of every option that takes a number.
void check_numbers(CLI::App& app) {
    for (CLI::Option* option : app.get_options()) {
        const std::string type = option->get_type_name();
        for (const char* number : {"INT", "UINT", "FLOAT"})
            if (type.starts_with(number)) option->check(check_decimal);
    }
}

// What the texts say; each has been checked.
void take_texts(const CLI::App& app, const OptionTexts& text, Options& options) {
    options.scene_given = app.count("--scene") > 0;
    options.scale_given = app.count("--scale") > 0;
    options.size_given = app.count("--size") > 0;
    options.technique_given = app.count("--technique") > 0;
    options.keep_up = app.count("--target-fps") > 0;
    options.load.show_backs = text.backfaces == "show";
    options.load.unlit = text.unlit == "emission" ? Unlit::emission : Unlit::albedo;
    options.surfaces = text.surfaces == "on";
    for (std::string& box : options.boxes)
        for (std::size_t i = 0; i < 9; ++i)
            box[i] = static_cast<char>(std::tolower(static_cast<unsigned char>(box[i])));
    options.inputs.sacn = *read_udp_address(text.sacn, kE131Port);
    options.inputs.artnet = *read_udp_address(text.artnet, kArtnetPort);
    options.inputs.osc = *read_udp_address(text.osc, kOscPort);
    options.inputs.accept_preview = !text.ignore_preview;
    const auto address = read_listen(text.listen);
    options.host = address->host;
    options.port = address->port;
    const auto pixels = read_size(text.size);
    options.width_px = pixels->width_px;
    options.height_px = pixels->height_px;
    if (!options.bake.scene.empty()) options.scene = options.bake.scene, options.scene_given = true;
    if (app.count("--samples") > 0) options.samples = text.samples;
    if (options.follow.empty()) return;
    options.surfaces = false;
    if (const auto leader = parse_server_url(options.follow)) options.follow = leader->url();
    for (const char* name : kOfLeader)
        if (app.count(std::string("--") + name) > 0) options.beside_follow.emplace_back(name);
}

}  // namespace

std::optional<Options> parse_options(const std::vector<std::string>& arguments, int& exit_code) {
    Options options;
    options.arguments = arguments;
    OptionTexts text;
    CLI::App app{"goniod: headless lighting-previsualisation server"};
    app.option_defaults()->always_capture_default();  // for --help and --print-config
    add_own_options(app, text);
    add_picture_options(app, options, text);
    add_input_options(app, options, text);
    add_bake_options(app, options.bake);
    add_front_options(app, options);
    check_numbers(app);
    Settings settings;
    try {
        parse(app, arguments);
        settings = complete_settings(app, arguments, ::environ);
        print_lines(settings.warnings, "warning: ");
        if (text.doctor) options.faults = std::exchange(settings.errors, {});  // it says them, and leaves them out
        print_lines(settings.errors, "");
        if (!settings.errors.empty()) {
            exit_code = kBadConfig;
            return std::nullopt;
        }
        parse(app, settings.arguments);
        take_texts(app, text, options);
    } catch (const CLI::ParseError& error) {
        exit_code = app.exit(error) == 0 ? 0 : kUsage;
        return std::nullopt;
    }
    std::vector<std::string> errors;
    for (const OptionFault& fault : check_front_options(options)) errors.push_back(placed(fault, settings));
    for (const OptionFault& fault : check_follow(options)) errors.push_back(placed(fault, settings));
    for (const OptionFault& fault : check_samples(options)) errors.push_back(placed(fault, settings));
    options.doctor = text.doctor;
    if (options.doctor) options.faults.insert(options.faults.end(), errors.begin(), errors.end()), errors.clear();
    print_lines(errors, "");
    exit_code = errors.empty() ? 0 : kBadConfig;
    if (text.dump_options) std::cout << dump_options(app, "goniod", GONIO_VERSION) << "\n";
    if (text.print_gltf) std::cout << gltf_features_text();
    if (text.print_config) std::cout << print_settings(app, settings);
    if (text.check_config && errors.empty()) std::cout << "ok\n";
    if (!errors.empty() || text.print_gltf || text.print_config || text.check_config || text.dump_options)
        return std::nullopt;
    return options;
}

}  // namespace gonio
