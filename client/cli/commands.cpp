#include "client/cli/commands.h"

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>

#include "client/cli/bake.h"
#include "client/cli/beside.h"
#include "client/cli/cli.h"
#include "client/cli/convert.h"
#include "client/cli/grids.h"
#include "client/cli/output.h"
#include "client/cli/photometry.h"
#include "client/cli/surfaces.h"
#include "protocol/dmx/patch_toml.h"
#include "protocol/schema/command.pb.h"
#include "protocol/schema/cue.pb.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/grid.pb.h"
#include "protocol/schema/measure.pb.h"
#include "protocol/schema/scene.pb.h"
#include "protocol/schema/surface.pb.h"
#include "protocol/schema/upload_name.h"
#include "protocol/schema/words.h"
#include "protocol/surface/surface_toml.h"

namespace gonio {
namespace {

using Answer = v1::ServerMessage;

// Asks, and has the answer printed. Result: the exit code.
int ask(const Session& session, v1::ClientMessage message, std::initializer_list<Answer::MessageCase> wanted,
        const std::function<void(const Answer&)>& print) {
    const auto answer = session.ask(std::move(message), wanted);
    if (!answer) return session.fail(answer.error());
    print(*answer);
    return kExitOk;
}

// load scene FILE --merge: what is changed is what was asked for, no warning.
int told(const Session& session, Result<Answer> answer, bool merge) {
    if (merge && answer && !session.json) {
        for (const std::string& line : answer->result().warnings()) session.out << line << "\n";
        answer->mutable_result()->clear_warnings();
    }
    return session.changed(answer);
}

// load scene FILE --upload, open show FILE --upload: sends the file, then has the server load it.
int load_upload(const Session& session, v1::ClientMessage message) {
    v1::Command& command = *message.mutable_command();
    const bool show = command.has_open_show();
    std::string& file =
        show ? *command.mutable_open_show()->mutable_name() : *command.mutable_load_scene()->mutable_file();
    const std::string name = std::filesystem::path(file).filename().string();
    if (session.role == "viewer")
        return session.fail(
            {"permission", show ? "open show" : "load scene", file, "a viewer may look and ask, not upload anything"});
    if (const auto sent = upload(session.address, session.token, file, name); !sent) return session.fail(sent.error());
    file = std::string(kUploadPrefix) + name;
    const bool merge = command.load_scene().merge();
    return told(session, session.ask(std::move(message), {Answer::kResult}), merge);
}

int change(const Session& session, const ReadWords& words) {
    v1::ClientMessage message = words.message;
    if (words.has("--upload")) return load_upload(session, std::move(message));
    v1::Command& command = *message.mutable_command();
    const auto attached = attach_profile_file(command);
    if (!attached) return session.fail(attached.error());
    if (command.has_load_scene()) {
        // The server resolves paths from its own folder; on the same machine the caller's is meant.
        std::string& file = *command.mutable_load_scene()->mutable_file();
        std::error_code error;
        if (std::filesystem::is_regular_file(file, error)) file = std::filesystem::absolute(file, error).string();
    }
    const bool merge = command.load_scene().merge();
    auto answer = session.ask(std::move(message), {Answer::kResult});
    if (!answer && answer.error().code == "not_found" && answer.error().where == "profile" && !*attached) {
        Error error = answer.error();
        const std::size_t hint = std::min(error.message.find(" Did you mean"), error.message.size());
        error.message = "The file does not exist, and the server's library has no profile of this name." +
                        error.message.substr(hint);
        return session.fail(error);
    }
    return told(session, std::move(answer), merge);
}

int get(const Session& session, const ReadWords& words) {
    const auto answer = session.ask(words.message, {Answer::kState});
    if (!answer) return session.fail(answer.error());
    const auto json = json_at(answer->state(), words.names.empty() ? "" : words.names.front(), session.json);
    if (!json) return session.fail(json.error());
    session.out << *json << "\n";
    return kExitOk;
}

int preset_list(const Session& session, const ReadWords& words) {
    return ask(session, words.message, {Answer::kState}, [&](const Answer& answer) {
        if (session.json) return session.print(answer.state().presets());
        session.out << presets_table(answer.state());
    });
}

int view_list(const Session& session, const ReadWords& words) {
    return ask(session, words.message, {Answer::kState}, [&](const Answer& answer) {
        if (session.json) return session.print(answer.state().saved_views());
        session.out << views_table(answer.state());
    });
}

int cue_list(const Session& session, const ReadWords& words) {
    return ask(session, words.message, {Answer::kState}, [&](const Answer& answer) {
        if (!session.json) return (void)(session.out << cue_table(answer.state()));
        session.out << "{\"cues\":" << to_json(answer.state().cues(), true)
                    << ",\"cue_playback\":" << to_json(answer.state().cue_playback(), true) << "}\n";
    });
}

int light_list(const Session& session, const ReadWords& words) {
    return ask(session, words.message, {Answer::kState}, [&](const Answer& answer) {
        if (!session.json) return (void)(session.out << lights_table(answer.state()));
        session.out << "{\"lights\":" << *json_at(answer.state(), "lights", true) << "}\n";
    });
}

int group_list(const Session& session, const ReadWords& words) {
    return ask(session, words.message, {Answer::kState}, [&](const Answer& answer) {
        if (!session.json) return (void)(session.out << groups_table(answer.state()));
        session.out << "{\"groups\":" << *json_at(answer.state(), "groups", true) << "}\n";
    });
}

// What the words say is the whole message, and a Result its answer.
int edit_shows(const Session& session, const ReadWords& words) {
    return session.change(words.message);
}

int shows(const Session& session, const ReadWords& words) {
    v1::ClientMessage message = words.message;
    if (words.has("--now") && !words.names.empty())
        return session.fail({"usage", "--now", words.names.front(), "A name and --now exclude each other."});
    if (words.has("--now")) message.mutable_shows()->set_text_of("");
    const bool text = message.shows().has_text_of();
    return ask(session, std::move(message), {Answer::kShows}, [&](const Answer& answer) {
        if (text)
            session.out << answer.shows().text();
        else
            session.out << (session.json ? to_json(answer.shows(), true) + "\n" : shows_table(answer.shows()));
    });
}

int gels(const Session& session, const ReadWords& words) {
    return ask(session, words.message, {Answer::kGels}, [&](const Answer& answer) {
        session.out << (session.json ? to_json(answer.gels(), true) + "\n" : gels_table(answer.gels()));
    });
}

int meter(const Session& session, const ReadWords& words) {
    return ask(session, words.message, {Answer::kMeter, Answer::kMeterGrid}, [&](const Answer& answer) {
        answer.has_meter() ? session.print(answer.meter()) : session.print(answer.meter_grid());
    });
}

int pick(const Session& session, const ReadWords& words) {
    return ask(session, words.message, {Answer::kPick}, [&](const Answer& answer) { session.print(answer.pick()); });
}

int library(const Session& session, const ReadWords& words) {
    v1::ClientMessage message = words.message;
    std::string text;
    for (const std::string& word : words.names) text += (text.empty() ? "" : " ") + word;
    message.mutable_library()->set_text(text);
    return ask(session, std::move(message), {Answer::kLibrary}, [&](const Answer& answer) {
        session.out << (session.json ? to_json(answer.library(), true) + "\n" : library_table(answer.library()));
        session.warn(answer.library().warnings());
    });
}

int capture(const Session& session, const ReadWords& words) {
    const std::string& file = words.names.front();
    const auto answer = session.ask(words.message, {Answer::kCapture});
    if (!answer) return session.fail(answer.error());
    const v1::CaptureResult& result = answer->capture();
    if (const auto written = write_atomically(file, result.image()); !written) return session.fail(written.error());
    if (session.json) {
        session.print(result);
        return kExitOk;
    }
    session.warn(result.warnings());
    session.out << file << " " << result.width_px() << "x" << result.height_px() << " scene_rev " << result.scene_rev();
    if (result.has_samples()) session.out << " samples " << result.samples();
    if (result.has_noise_ratio())
        session.out << " noise " << print_number(result.noise_ratio());
    else if (result.has_samples())
        session.out << " noise not known: 8 samples are the fewest that tell it";
    if (result.denoised()) session.out << " denoised to " << print_number(result.denoised_noise_ratio());
    if (result.has_noise_reached() && !result.noise_reached()) session.out << " (the noise asked for is not reached)";
    session.out << "\n";
    return kExitOk;
}

// Writes what was made and says where it is; told: beside the file's name. Result: the exit code.
template <typename Made>
int write_made(const Session& session, const std::string& file, const std::string& bytes, const Made& made,
               const std::string& told) {
    if (const auto written = write_atomically(file, bytes); !written) return session.fail(written.error());
    if (session.json)
        session.print(made);
    else
        session.out << file << told << " scene_rev " << made.scene_rev() << "\n";
    return kExitOk;
}

int save_scene(const Session& session, const ReadWords& words) {
    const auto answer = session.ask(words.message, {Answer::kCapture});
    if (!answer) return session.fail(answer.error());
    const v1::CaptureResult& made = answer->capture();
    if (!session.json) session.warn(made.warnings());
    return write_made(session, words.names.front(), made.image(), made,
                      " " + std::to_string(made.image().size()) + " bytes");
}

int grid_list(const Session& session, const ReadWords& words) {
    return ask(session, words.message, {Answer::kState}, [&](const Answer& answer) {
        session.json ? session.print(answer.state().grids()) : void(session.out << grids_table(answer.state().grids()));
    });
}

int grid_values(const Session& session, const ReadWords& words) {
    if (words.has("--csv") && session.json)
        return session.fail({"usage", "--csv", "--json", "One of the two can be printed."});
    return ask(session, words.message, {Answer::kGridValues}, [&](const Answer& answer) {
        const v1::GridValues& values = answer.grid_values();
        if (session.json) return session.print(values);
        session.out << (words.has("--csv") ? grid_csv(values) : grid_text(values));
        session.warn(values.warnings());
    });
}

int observer_list(const Session& session, const ReadWords& words) {
    return ask(session, words.message, {Answer::kState}, [&](const Answer& answer) {
        if (session.json) return session.print(answer.state().observers());
        session.out << observers_table(answer.state().observers());
    });
}

int ugr(const Session& session, const ReadWords& words) {
    return ask(session, words.message, {Answer::kUgr}, [&](const Answer& answer) {
        session.json ? session.print(answer.ugr()) : void(session.out << ugr_text(answer.ugr()));
        session.warn(answer.ugr().warnings());
    });
}

int targets(const Session& session, const ReadWords& words) {
    return ask(session, words.message, {Answer::kTargets}, [&](const Answer& answer) {
        session.json ? session.print(answer.targets()) : void(session.out << targets_table(answer.targets()));
    });
}

int lux_report(const Session& session, const ReadWords& words) {
    const auto answer = session.ask(words.message, {Answer::kLuxReport});
    if (!answer) return session.fail(answer.error());
    return write_made(session, words.names.front(), answer->lux_report().html(), answer->lux_report(), "");
}

int report(const Session& session, const ReadWords& words) {
    return ask(session, words.message, {Answer::kReport}, [&](const Answer& answer) {
        if (words.has("--table"))
            session.out << report_table(answer.report());
        else
            session.print(answer.report());
    });
}

int stats(const Session& session, const ReadWords& words) {
    return ask(session, words.message, {Answer::kStats}, [&](const Answer& answer) { session.print(answer.stats()); });
}

int sources(const Session& session, const ReadWords& words) {
    return ask(session, words.message, {Answer::kSources}, [&](const Answer& answer) {
        session.out << (session.json ? to_json(answer.sources(), true) + "\n" : sources_table(answer.sources()));
    });
}

// Result: the text of the file that replaces a patch or a map, empty for --default and --none; nothing where neither
// is given. Errors: "usage", "file_unreadable".
Result<std::optional<std::string>> replacement(const ReadWords& words) {
    const std::string command(words.command->name);
    const std::size_t flags = words.has("--default") + words.has("--none");
    if (flags + words.names.size() > 1)
        return Error{"usage", command, "", "A file, --default and --none exclude each other."};
    if (words.names.empty()) return flags > 0 ? std::optional<std::string>("") : std::nullopt;
    std::ifstream file(words.names.front(), std::ios::binary);
    std::string text((std::istreambuf_iterator<char>(file)), {});
    if (!file.is_open()) return Error{"file_unreadable", command, words.names.front(), "The file cannot be read."};
    return std::optional(std::move(text));
}

int patch(const Session& session, const ReadWords& words) {
    const auto text = replacement(words);
    if (!text) return session.fail(text.error());
    v1::ClientMessage message;
    if (!*text) {
        message.mutable_patch();
        return ask(session, std::move(message), {Answer::kPatch}, [&](const Answer& answer) {
            session.out << (session.json ? to_json(answer.patch(), true) + "\n" : write_patch_toml(answer.patch()));
            session.warn(answer.patch().warnings());
        });
    }
    auto set = read_patch_toml(**text);
    if (!set) return session.fail(set.error());
    set->set_use_default(words.has("--default"));
    *message.mutable_command()->mutable_set_patch() = std::move(*set);
    return session.change(std::move(message));
}

int surfaces(const Session& session, const ReadWords& words) {
    const auto text = replacement(words);
    if (!text) return session.fail(text.error());
    v1::ClientMessage message;
    if (!*text) {
        message.mutable_surfaces();
        return ask(session, std::move(message), {Answer::kSurfaces}, [&](const Answer& answer) {
            session.out << (session.json ? to_json(answer.surfaces(), true) + "\n" : surfaces_table(answer.surfaces()));
        });
    }
    auto set = read_surfaces_toml(**text);
    if (!set) return session.fail(set.error());
    if (words.names.empty()) set->set_with_default(words.has("--default"));
    *message.mutable_command()->mutable_set_surfaces() = std::move(*set);
    return session.change(std::move(message));
}

int learn(const Session& session, const ReadWords& words) {
    const auto request = learn_request(words);
    if (!request) return session.fail(request.error());
    v1::ClientMessage message;
    message.mutable_learn()->set_timeout_s(request->timeout_s);
    const auto answer = session.ask(std::move(message), {Answer::kLearned}, "move a control …");
    if (!answer) return session.fail(answer.error());
    const v1::Learned& learned = answer->learned();
    if (learned.device().empty()) return session.fail({"refused", "learn", "", "No control moved in time."});
    if (session.json)
        session.print(learned);
    else
        session.out << learned.device() << " " << learned.control() << " (" << learned.kind() << ", "
                    << learned.product() << ")\n";
    if (!request->row) return kExitOk;
    v1::ClientMessage mapping = words.message;
    v1::SurfaceRow& row = *mapping.mutable_command()->mutable_map_control()->mutable_row();
    row = *request->row;
    row.set_device(request->any_box ? "*" : learned.device());
    row.set_control(learned.control());
    return session.change(std::move(mapping));
}

int forget(const Session& session, const ReadWords& words) {
    v1::ClientMessage message = words.message;
    v1::MapControl& map = *message.mutable_command()->mutable_map_control();
    map.set_remove(true);
    if (!words.has("--box")) map.mutable_row()->set_device("*");
    return session.change(std::move(message));
}

int photometry(const Session& session, const ReadWords& words) {
    const PhotometryFormat format = words.has("--svg") ? PhotometryFormat::svg
                                    : session.json     ? PhotometryFormat::json
                                                       : PhotometryFormat::text;
    constexpr double kCatalogueSpacing = 0.25;
    std::optional<double> spacing;
    if (words.has("--ugr"))
        spacing = words.has("--spacing") ? parse_number(words.options.at("--spacing")) : kCatalogueSpacing;
    const auto option = [&](const char* name) { return words.has(name) ? words.options.at(name) : std::string(); };
    return run_photometry(words.names, format, session.out, session.err, spacing,
                          {option("--variant"), option("--emitter")});
}

}  // namespace

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

int run_command(const Session& session, const ReadWords& words) {
    struct Row {
        const char* name;
        int (*run)(const Session&, const ReadWords&);
    };
    constexpr Row rows[] = {{"get", get},
                            {"save show", edit_shows},
                            {"show rename", edit_shows},
                            {"show remove", edit_shows},
                            {"save scene", save_scene},
                            {"shows", shows},
                            {"gels", gels},
                            {"meter", meter},
                            {"pick", pick},
                            {"library", library},
                            {"capture", capture},
                            {"light list", light_list},
                            {"group list", group_list},
                            {"preset list", preset_list},
                            {"cue list", cue_list},
                            {"view list", view_list},
                            {"grid list", grid_list},
                            {"grid values", grid_values},
                            {"observer list", observer_list},
                            {"ugr", ugr},
                            {"targets", targets},
                            {"lux-report", lux_report},
                            {"report", report},
                            {"stats", stats},
                            {"watch", watch},
                            {"relay", relay},
                            {"sources", sources},
                            {"patch", patch},
                            {"surfaces", surfaces},
                            {"learn", learn},
                            {"forget", forget},
                            {"control acquire", control},
                            {"control release", control},
                            {"bake", bake},
                            {"doctor", doctor},
                            {"photometry", photometry},
                            {"convert", convert}};
    for (const Row& row : rows)
        if (words.command->name == row.name) return row.run(session, words);
    return change(session, words);
}

}  // namespace gonio
