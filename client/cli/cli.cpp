#include "client/cli/cli.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "client/cli/consoles.h"
#include "client/cli/control.h"
#include "client/cli/output.h"
#include "client/cli/photometry.h"
#include "client/cli/surfaces.h"
#include "client/cli/transport.h"
#include "protocol/dmx/patch_toml.h"
#include "protocol/schema/codec.h"
#include "protocol/schema/upload_name.h"
#include "protocol/schema/words.h"
#include "protocol/surface/surface_toml.h"

namespace gonio {
namespace {

using Words = std::span<const std::string>;

constexpr const char* kHelp = R"(usage: gonio [--server URL] [--token-file FILE] [--ca FILE] [--json] COMMAND

Talks to a running goniod. Angles are degrees here, all else is SI; a vector is written x,y,z (world, metres, +Y up).

  get [PATH]                  the state or a part of it: lights[0].aim, lights.NAME.level_ratio, camera.eye
  load scene FILE [--upload]  cornell, atrium, or a .gltf or .glb on the server's machine; --upload: on this one
  set technique default|seed [--samples N]
  set view NAME [--gain G] [--light LIGHT]
                              beauty direct indirect illuminance luminance mask rsm-depth rsm-normal rsm-flux solid
  set exposure EV             EV100
  set master RATIO            0..1
  set light NAME [--position x,y,z] [--aim x,y,z | --pan DEG --tilt DEG --roll DEG] [--level RATIO]
            [--color r,g,b] [--profile FILE]
                              NAME may be a group; FILE is uploaded, what is no file names a built-in luminaire
  set camera [--eye x,y,z] [--target x,y,z] [--fov DEG]
  set size WxH                pixels, even
  add light NAME --profile FILE [options of set light]
  remove light NAME
  group NAME LIGHT…           without lights: removes the group
  meter --point x,y,z --normal x,y,z [--quality interactive|rsm|reference] [--bounces N|all] [--noise R] [--openings]
        [--u x,y,z --v x,y,z --count NUxNV]
                              illuminance in lux with its standard error; reference is path-traced: 0..64 diffuse
                              bounces or all (default), until the error is R of the total (0.005), --openings: from
                              luminous openings instead of points; --count: the cell centres of a grid of at most
                              4096 over the rectangle u, v from the point
  capture OUT.png|jpg|exr [--view NAME] [--size WxH] [--quality interactive|reference] [--bounces N|all] [--noise R]
          [--openings] [--after-rev N]
                              reference: beauty direct indirect illuminance luminance, until the noise is R (0.02);
                              after-rev: of the scene when it has reached that revision, waited for up to 30 s
  report [--rev N] [--table]  what the first frame with scene_rev >= N ran, and how long; without N: the newest
  stats                       counters of the server
  sources                     who sends sACN, Art-Net and OSC: rate, loss, levels, who wins; --json: all slots
  patch [FILE.toml | --default | --none]
                              which slots drive what: prints it, or replaces it (docs/consoles.md)
  preset save|recall|remove NAME [--fade S]
                              level, colour, aim, position and profile of all lights; S: recalled over so many seconds
  surfaces [FILE.toml | --default | --none]
                              fader boxes, their controls and what they drive; or another map (docs/faders.md)
  learn [TARGET PROPERTY | PROPERTY | preset NAME [--fade S]] [--range LOW,HIGH] [--curve linear|square|cube|s]
        [--takeover pickup|jump] [--mode M] [--page N] [--step R] [--any-box] [--timeout S]
                              waits for a control that a hand moves and names it; with a property, it drives that
                              from then on
  forget CONTROL [--box BOX] [--page N]
                              the control drives nothing of its own any more
  control acquire [--take] [--hold S] | release [--take]
                              alone moves the camera for S seconds, or until interrupted; --take: also from a holder
  photometry FILE… [--svg]    offline: quantities, provenance and diagnostics of photometry files
  watch [--frames N] [--out FILE.h264]
                              one JSON line for each change and frame, until interrupted or after N frames

  --server URL                default: $GONIO_SERVER, else http://127.0.0.1:8080
  --token-file FILE           bearer token, where the server asks for one
  --role viewer               may look and ask, not change anything
  --base-rev N                with a change: refused where somebody else changed what it sets after revision N
  --ca FILE                   of https: the authorities to trust instead of the system's (PEM)
  --json                      one line of JSON, also for refusals; before or after the command
  --help, --version

Every change prints the scene_rev that contains it.
exit codes: 0 ok, 1 refused by the server, 2 usage, 3 unreachable
)";

constexpr const char* kVersion = "gonio " GONIO_VERSION ", protocol gonio.v1\n";

// What one call of gonio works with.
struct Session {
    ServerAddress address;
    std::string token;
    std::string role;
    bool json = false;
    std::ostream& out;
    std::ostream& err;

    // JSON: indented for people, one line with --json.
    void print(const google::protobuf::Message& message) const { out << to_json(message, json) << "\n"; }
    // Result: the exit code; the error goes to stderr, with --json also to `out`, as the Result that a server sends.
    int fail(const Error& error) const {
        if (json) print(refusal(error));
        err << "gonio: " << error.code;
        if (!error.where.empty()) err << " " << error.where;
        if (!error.value.empty()) err << " " << error.value;
        err << ": " << error.message << "\n";
        if (error.code == "usage") err << "gonio --help lists the commands\n";
        if (error.code == "usage" || error.code == "file_unreadable" || error.code == "file_unwritable")
            return kExitUsage;
        return error.code == "unreachable" || error.code == "untrusted" ? kExitUnreachable : kExitRefused;
    }
    Result<v1::ServerMessage> ask(v1::ClientMessage message) const {
        auto connection = Connection::open(address, {token, false, false, role});
        if (!connection) return connection.error();
        const bool terminal = &err == &std::cerr && ::isatty(STDERR_FILENO) == 1;
        std::size_t shown = 0;  // characters of the progress line
        auto answer = (*connection)->ask(std::move(message), [&](const v1::Progress& progress) {
            if (!terminal) return;
            const std::string line = progress_line(progress);
            err << "\r" << line << std::string(shown > line.size() ? shown - line.size() : 0, ' ') << std::flush;
            shown = line.size();
        });
        if (shown > 0) err << "\r" << std::string(shown, ' ') << "\r" << std::flush;
        if (answer && answer->has_result() && answer->result().code() != "ok") {
            const v1::Result& result = answer->result();
            return Error{result.code(), result.field(), result.value(), result.message()};
        }
        return answer;
    }
};

Error unexpected_answer() {
    return {"bad_message", "", "", "The server's answer is not one to this question."};
}

// Sends a command and prints the revision that contains it.
int send_change(const Session& session, const v1::ClientMessage& message) {
    const auto answer = session.ask(message);
    if (!answer) return session.fail(answer.error());
    if (!answer->has_result()) return session.fail(unexpected_answer());
    if (session.json) {
        session.out << to_json(answer->result(), true) << "\n";
        return kExitOk;
    }
    for (const std::string& warning : answer->result().warnings()) session.err << "warning: " << warning << "\n";
    session.out << "scene_rev " << answer->result().scene_rev() << "\n";
    return kExitOk;
}

// load scene FILE --upload: sends the file, then has the server load it.
int load_upload(const Session& session, const std::string& file) {
    const std::string name = std::filesystem::path(file).filename().string();
    if (session.role == "viewer")
        return session.fail({"permission", "load scene", file, "a viewer may look and ask, not upload anything"});
    if (const auto sent = upload(session.address, session.token, file, name); !sent) return session.fail(sent.error());
    v1::ClientMessage message;
    message.mutable_command()->mutable_load_scene()->set_file(std::string(kUploadPrefix) + name);
    return send_change(session, message);
}

int change(const Session& session, Words words) {
    if (words.size() == 4 && words[0] == "load" && words[1] == "scene") {
        if (words[3] == "--upload") return load_upload(session, words[2]);
        if (words[2] == "--upload") return load_upload(session, words[3]);
    }
    auto command = command_from_words(words);
    if (!command) return session.fail(command.error());
    if (auto attached = attach_profile_file(*command); !attached) return session.fail(attached.error());
    if (command->has_load_scene()) {
        // The server resolves paths from its own folder; on the same machine the caller's is meant.
        std::string& file = *command->mutable_load_scene()->mutable_file();
        std::error_code error;
        if (std::filesystem::is_regular_file(file, error)) file = std::filesystem::absolute(file, error).string();
    }
    v1::ClientMessage message;
    *message.mutable_command() = std::move(*command);
    return send_change(session, message);
}

int get(const Session& session, Words words) {
    const auto paths = parse_words(words, {}, 0, 1);
    if (!paths) return session.fail(paths.error());
    v1::ClientMessage message;
    message.mutable_get_state();
    const auto answer = session.ask(std::move(message));
    if (!answer) return session.fail(answer.error());
    if (!answer->has_state()) return session.fail(unexpected_answer());
    const auto json = json_at(answer->state(), paths->empty() ? "" : paths->front(), session.json);
    if (!json) return session.fail(json.error());
    session.out << *json << "\n";
    return kExitOk;
}

auto text_setter(std::string* field) {
    return [field](const std::string& text) {
        *field = text;
        return true;
    };
}

int meter(const Session& session, Words words) {
    auto query = meter_from_words(words);
    if (!query) return session.fail(query.error());
    v1::ClientMessage message;
    *message.mutable_meter() = std::move(*query);
    const auto answer = session.ask(std::move(message));
    if (!answer) return session.fail(answer.error());
    if (answer->has_meter())
        session.print(answer->meter());
    else if (answer->has_meter_grid())
        session.print(answer->meter_grid());
    else
        return session.fail(unexpected_answer());
    return kExitOk;
}

// Writes beside the target and renames, so that nobody ever reads half a file. Errors: "file_unwritable".
Result<bool> write_atomically(const std::filesystem::path& path, const std::string& bytes) {
    std::filesystem::path temporary = path;
    temporary += ".part-" + std::to_string(::getpid());
    std::error_code error;
    std::ofstream file(temporary, std::ios::binary);
    file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    file.close();
    if (file) std::filesystem::rename(temporary, path, error);
    if (file && !error) return true;
    std::filesystem::remove(temporary, error);
    return Error{"file_unwritable", "", path.string(), "The file cannot be written."};
}

int capture(const Session& session, Words words) {
    auto asked = capture_from_words(words);
    if (!asked) return session.fail(asked.error());
    v1::ClientMessage message;
    *message.mutable_capture() = std::move(asked->query);
    const auto answer = session.ask(std::move(message));
    if (!answer) return session.fail(answer.error());
    if (!answer->has_capture()) return session.fail(unexpected_answer());
    const v1::CaptureResult& result = answer->capture();
    if (const auto written = write_atomically(asked->file, result.image()); !written)
        return session.fail(written.error());
    if (session.json) {
        session.out << to_json(result, true) << "\n";
        return kExitOk;
    }
    session.out << asked->file << " " << result.width_px() << "x" << result.height_px() << " scene_rev "
                << result.scene_rev();
    if (result.has_samples())
        session.out << " samples " << result.samples() << " noise " << print_number(result.noise_ratio());
    session.out << "\n";
    return kExitOk;
}

int report(const Session& session, Words words) {
    v1::ClientMessage message;
    v1::ReportQuery& query = *message.mutable_report();
    bool table = false;
    const WordOption options[] = {{"--table", nullptr, &table}, {"--rev", [&](const std::string& text) {
                                                                     const auto rev = parse_count(text);
                                                                     if (rev) query.set_rev(*rev);
                                                                     return rev.has_value();
                                                                 }}};
    if (const auto read = parse_words(words, options, 0, 0); !read) return session.fail(read.error());
    const auto answer = session.ask(std::move(message));
    if (!answer) return session.fail(answer.error());
    if (!answer->has_report()) return session.fail(unexpected_answer());
    if (table)
        session.out << report_table(answer->report());
    else
        session.print(answer->report());
    return kExitOk;
}

int stats(const Session& session, Words words) {
    if (const auto read = parse_words(words, {}, 0, 0); !read) return session.fail(read.error());
    v1::ClientMessage message;
    message.mutable_stats();
    const auto answer = session.ask(std::move(message));
    if (!answer) return session.fail(answer.error());
    if (!answer->has_stats()) return session.fail(unexpected_answer());
    session.print(answer->stats());
    return kExitOk;
}

int sources(const Session& session, Words words) {
    if (const auto read = parse_words(words, {}, 0, 0); !read) return session.fail(read.error());
    v1::ClientMessage message;
    message.mutable_sources();
    const auto answer = session.ask(std::move(message));
    if (!answer) return session.fail(answer.error());
    if (!answer->has_sources()) return session.fail(unexpected_answer());
    session.out << (session.json ? to_json(answer->sources(), true) + "\n" : sources_table(answer->sources()));
    return kExitOk;
}

int patch(const Session& session, Words words) {
    bool use_default = false, none = false;
    const WordOption options[] = {{"--default", nullptr, &use_default}, {"--none", nullptr, &none}};
    const auto files = parse_words(words, options, 0, 1);
    if (!files) return session.fail(files.error());
    if (use_default + none + static_cast<int>(files->size()) > 1)
        return session.fail({"usage", "patch", "", "A file, --default and --none exclude each other."});
    v1::ClientMessage message;
    if (files->empty() && !use_default && !none) {
        message.mutable_patch();
        const auto answer = session.ask(std::move(message));
        if (!answer) return session.fail(answer.error());
        if (!answer->has_patch()) return session.fail(unexpected_answer());
        session.out << (session.json ? to_json(answer->patch(), true) + "\n" : write_patch_toml(answer->patch()));
        for (const std::string& warning : answer->patch().warnings()) session.err << "warning: " << warning << "\n";
        return kExitOk;
    }
    v1::SetPatch& set = *message.mutable_command()->mutable_set_patch();
    set.set_use_default(use_default);
    if (!files->empty()) {
        std::ifstream file(files->front(), std::ios::binary);
        const std::string text((std::istreambuf_iterator<char>(file)), {});
        if (!file.is_open())
            return session.fail({"file_unreadable", "patch", files->front(), "The patch cannot be read."});
        auto read = read_patch_toml(text);
        if (!read) return session.fail(read.error());
        set = std::move(*read);
    }
    return send_change(session, message);
}

int surfaces(const Session& session, Words words) {
    bool use_default = false, none = false;
    const WordOption options[] = {{"--default", nullptr, &use_default}, {"--none", nullptr, &none}};
    const auto files = parse_words(words, options, 0, 1);
    if (!files) return session.fail(files.error());
    if (use_default + none + static_cast<int>(files->size()) > 1)
        return session.fail({"usage", "surfaces", "", "A file, --default and --none exclude each other."});
    v1::ClientMessage message;
    if (files->empty() && !use_default && !none) {
        message.mutable_surfaces();
        const auto answer = session.ask(std::move(message));
        if (!answer) return session.fail(answer.error());
        if (!answer->has_surfaces()) return session.fail(unexpected_answer());
        session.out << (session.json ? to_json(answer->surfaces(), true) + "\n" : surfaces_table(answer->surfaces()));
        return kExitOk;
    }
    v1::SetSurfaces& set = *message.mutable_command()->mutable_set_surfaces();
    set.set_with_default(use_default);
    if (!files->empty()) {
        std::ifstream file(files->front(), std::ios::binary);
        const std::string text((std::istreambuf_iterator<char>(file)), {});
        if (!file.is_open())
            return session.fail({"file_unreadable", "surfaces", files->front(), "The map cannot be read."});
        auto read = read_surfaces_toml(text);
        if (!read) return session.fail(read.error());
        set = std::move(*read);
    }
    return send_change(session, message);
}

int learn(const Session& session, Words words) {
    auto wish = learn_from_words(words);
    if (!wish) return session.fail(wish.error());
    v1::ClientMessage message;
    message.mutable_learn()->set_timeout_s(wish->timeout_s);
    if (!session.json) session.err << "move a control …" << std::endl;
    const auto answer = session.ask(std::move(message));
    if (!answer) return session.fail(answer.error());
    if (!answer->has_learned()) return session.fail(unexpected_answer());
    const v1::Learned& learned = answer->learned();
    if (learned.device().empty()) return session.fail({"refused", "learn", "", "No control moved in time."});
    if (session.json)
        session.print(learned);
    else
        session.out << learned.device() << " " << learned.control() << " (" << learned.kind() << ", "
                    << learned.product() << ")\n";
    if (!wish->row) return kExitOk;
    v1::ClientMessage change;
    v1::SurfaceRow& row = *change.mutable_command()->mutable_map_control()->mutable_row();
    row = *wish->row;
    row.set_device(wish->any_box ? "*" : learned.device());
    row.set_control(learned.control());
    return send_change(session, change);
}

int forget(const Session& session, Words words) {
    v1::ClientMessage message;
    v1::MapControl& map = *message.mutable_command()->mutable_map_control();
    map.set_remove(true);
    map.mutable_row()->set_device("*");
    const WordOption options[] = {{"--box", text_setter(map.mutable_row()->mutable_device())},
                                  {"--page", [&](const std::string& text) {
                                       const auto page = parse_count(text);
                                       if (page) map.mutable_row()->set_page(*page);
                                       return page.has_value();
                                   }}};
    const auto names = parse_words(words, options, 1, 1);
    if (!names) return session.fail(names.error());
    map.mutable_row()->set_control(names->front());
    return send_change(session, message);
}

std::string frame_line(const ServerEvent& event) {
    char text[256];
    std::snprintf(text, sizeof text,
                  "{\"frame\":{\"seq\":%u,\"scene_rev\":%u,\"key\":%s,\"final\":%s,\"lane\":%u,\"bytes\":%zu,"
                  "\"rendered_s\":%.6f,\"render_us\":%u,\"encode_us\":%u}}",
                  event.header.seq, event.header.scene_rev, event.header.key ? "true" : "false",
                  event.header.final ? "true" : "false", event.header.lane, event.access_unit.size(),
                  static_cast<double>(event.header.rendered_ns) * 1e-9, event.header.render_us, event.header.encode_us);
    return text;
}

int watch(const Session& session, Words words) {
    std::uint32_t frames = 0;
    std::string out_name;
    const WordOption options[] = {{"--frames",
                                   [&](const std::string& text) {
                                       const auto count = parse_count(text);
                                       if (count) frames = *count;
                                       return count && *count > 0;
                                   }},
                                  {"--out", text_setter(&out_name)}};
    if (const auto read = parse_words(words, options, 0, 0); !read) return session.fail(read.error());
    std::ofstream file;
    if (!out_name.empty()) {
        file.open(out_name, std::ios::binary);
        if (!file) return session.fail({"file_unwritable", "--out", out_name, "The file cannot be written."});
    }
    auto connection = Connection::open(session.address, {session.token, true, true, session.role});
    if (!connection) return session.fail(connection.error());
    for (std::uint32_t seen = 0; frames == 0 || seen < frames;) {
        const auto event = (*connection)->next();
        if (!event) return session.fail(event.error());
        if (!event->access_unit.empty()) {
            ++seen;
            session.out << frame_line(*event) << std::endl;
            file.write(reinterpret_cast<const char*>(event->access_unit.data()),
                       static_cast<std::streamsize>(event->access_unit.size()));
            file.flush();
            if (!out_name.empty() && !file)
                return session.fail({"file_unwritable", "--out", out_name, "The file cannot be written."});
            v1::ClientMessage ack;
            ack.mutable_frame_ack()->set_seq(event->header.seq);
            if (const auto said = (*connection)->say(ack); !said) return session.fail(said.error());
        } else if (event->message.has_state_changed()) {
            session.out << "{\"state_changed\":" << to_json(event->message.state_changed(), true) << "}" << std::endl;
        } else if (event->message.has_video_config()) {  // another size, encoder or lane
            session.out << "{\"video_config\":" << to_json(event->message.video_config(), true) << "}" << std::endl;
        } else if (event->message.has_ready()) {  // instead of many changes
            session.out << "{\"ready\":" << to_json(event->message.ready(), true) << "}" << std::endl;
        } else if (event->message.has_goodbye()) {
            return session.fail({"unreachable", "", session.address.host_header(), event->message.goodbye().reason()});
        }
    }
    return kExitOk;
}

int control(const Session& session, Words words) {
    std::ostream silent(nullptr);  // scripts go by the exit code
    const auto refused = run_control(session.address, {session.token, false, false, session.role}, words,
                                     session.json ? silent : session.out);
    return refused ? session.fail(*refused) : kExitOk;
}

int photometry(const Session& session, Words words) {
    bool svg = false;
    const WordOption options[] = {{"--svg", {}, &svg}};
    const auto files = parse_words(words, options, 1, 1'000'000);
    if (!files) return session.fail(files.error());
    const PhotometryFormat format = svg            ? PhotometryFormat::svg
                                    : session.json ? PhotometryFormat::json
                                                   : PhotometryFormat::text;
    return run_photometry(*files, format, session.out, session.err);
}

Result<std::string> read_token(const std::string& file_name) {
    std::ifstream file(file_name);
    std::string token;
    std::getline(file, token);
    if (!file.is_open() || file.bad())
        return Error{"file_unreadable", "--token-file", file_name, "The token cannot be read."};
    while (!token.empty() && (token.back() == '\r' || token.back() == ' ')) token.pop_back();
    return token;
}

}  // namespace

int run_cli(Words args, std::ostream& out, std::ostream& err) {
    const char* environment = std::getenv("GONIO_SERVER");
    std::string server = environment && *environment ? environment : "http://127.0.0.1:8080";
    std::string token_file, ca_file;
    Session session{{}, {}, {}, false, out, err};
    std::vector<std::string> words;
    bool help = args.empty();
    for (std::size_t i = 0; i < args.size(); ++i) {
        const std::string& arg = args[i];
        const auto value_of = [&](const std::string& name, std::string& value) {
            if (arg.starts_with(name + "=")) {
                value = arg.substr(name.size() + 1);
            } else if (arg != name || i + 1 == args.size()) {
                return false;
            } else {
                value = args[++i];
            }
            return true;
        };
        if (arg == "--") {  // the rest belongs to the command
            words.insert(words.end(), args.begin() + static_cast<std::ptrdiff_t>(i), args.end());
            break;
        }
        if (value_of("--server", server) || value_of("--token-file", token_file) || value_of("--ca", ca_file) ||
            value_of("--role", session.role))
            continue;
        if (arg == "--json") {
            session.json = true;
        } else if (arg == "--help" || arg == "-h") {
            help = true;
        } else if (arg == "--version" && words.empty()) {
            out << kVersion;
            return kExitOk;
        } else {
            words.push_back(arg);
        }
    }
    if (help) {
        (args.empty() ? err : out) << kHelp;
        return args.empty() ? kExitUsage : kExitOk;
    }
    if (words.empty()) return session.fail({"usage", "", "", "There is no command."});
    const std::string& verb = words.front();
    const Words rest = Words(words).subspan(1);
    if (verb == "photometry") return photometry(session, rest);

    const auto address = parse_server_url(server);
    if (!address) return session.fail(address.error());
    session.address = *address;
    session.address.ca_file = ca_file;
    if (!token_file.empty()) {
        const auto token = read_token(token_file);
        if (!token) return session.fail(token.error());
        session.token = *token;
    }
    struct Row {
        const char* verb;
        int (*run)(const Session&, Words);
    };
    constexpr Row rows[] = {{"get", get},           {"meter", meter}, {"capture", capture}, {"report", report},
                            {"stats", stats},       {"watch", watch}, {"sources", sources}, {"patch", patch},
                            {"surfaces", surfaces}, {"learn", learn}, {"forget", forget},   {"control", control}};
    for (const Row& row : rows)
        if (verb == row.verb) return row.run(session, rest);
    for (const char* changing : {"set", "load", "add", "remove", "group", "preset"})
        if (verb == changing) return change(session, words);
    return session.fail({"usage", "", verb, "There is no such command."});
}

}  // namespace gonio
