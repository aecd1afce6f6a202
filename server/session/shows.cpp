#include "server/session/shows.h"

#include <utility>

#include "protocol/schema/codec.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/library.pb.h"
#include "protocol/schema/show.pb.h"
#include "protocol/text/shortened_text.h"
#include "server/scene/asset_files.h"
#include "server/scene/cue.h"
#include "server/scene/scene.h"
#include "server/scene/state.h"
#include "server/show/held_files.h"
#include "server/show/saved_show.h"
#include "server/show/show_folder.h"

namespace gonio {
namespace {

// The show as it stands, with the files of its scene where it then has at most so many bytes. not_held: why it has none
// of them; empty: it has them, or they are built in.
std::string text_of(const Scene& scene, std::size_t most_bytes, std::string& not_held) {
    ProfileTexts texts;
    saved::Show show = show_of(scene, texts);
    std::uint64_t bytes = 0;
    if (scene.asset->files)
        for (const AssetFile& file : scene.asset->files->files) bytes += file.bytes;
    if (bytes / 3 * 4 > most_bytes)  // as Base64
        not_held = "its files are too many bytes for " + std::to_string(most_bytes >> 20) + " MiB of text";
    else
        not_held = hold_files(*scene.asset, true, show);
    std::string text = write_show(show);
    if (text.size() <= most_bytes || show.files().empty()) return text;
    not_held = "with the scene's files it is " + std::to_string(text.size() >> 20) + " MiB, of which there are " +
               std::to_string(most_bytes >> 20) + " at most";
    show.clear_files();
    return write_show(show);
}

// why: of hold_files.
std::string not_held_warning(const std::string& why) {
    return "the show does not hold its scene: " + why + ". It opens only where the scene's files are";
}

Result<v1::Shows> shows_reply(const v1::ShowsQuery& query, const Scene& scene, const std::string& folder) {
    auto shows = list_shows(folder);
    if (!shows || !query.has_text_of()) return shows;
    std::string name;
    if (!query.text_of().empty()) {
        auto checked = checked_show_name(query.text_of(), "shows.text_of");
        if (!checked) return checked.error();
        name = *checked;
    }
    std::string not_held;
    auto text = name.empty() ? Result<std::string>(text_of(scene, kMaxShownBytes, not_held))
                             : read_show_file(folder, name, kMaxShownBytes);
    if (!text) return text.error();
    if (text->size() > kMaxShownBytes)
        return Error{"too_large", "shows.text_of", name,
                     "a client is sent at most " + std::to_string(kMaxShownBytes >> 20) + " MiB: the show has " +
                         std::to_string(text->size()) + " bytes"};
    shows->set_text_of(name);
    shows->set_not_held(not_held);
    shows->set_text(std::move(*text));
    return shows;
}

}  // namespace

void answer_shows(const Work& work, const Scene& scene, const SceneAccess& access, Loader& loader, Replies& replies) {
    const bool accepted = loader.submit([work, scene, folder = access.show_folder, send = replies.sender()] {
        auto shows = shows_reply(work.message.shows(), scene, folder);
        v1::ServerMessage message = shows ? message_of(&v1::ServerMessage::mutable_shows, std::move(*shows))
                                          : message_of(&v1::ServerMessage::mutable_result, refusal(shows.error()));
        message.set_request_id(work.message.request_id());
        send(work.session, std::move(message));
    });
    if (!accepted) replies.busy(work, "too many files are waiting to be read");
}

std::optional<Error> check_save(v1::SaveShow& save, const Scene& scene, const SceneAccess& access) {
    if (access.show_folder.empty())
        return Error{"unsupported", "save_show", "", "this server has no folder of shows: neither --shows nor --state"};
    if (save.name().empty() && scene.show_name.empty())
        return Error{"invalid_argument", "save_show.name", "", "the show has no name yet"};
    const auto name = checked_show_name(save.name().empty() ? scene.show_name : save.name(), "save_show.name");
    if (!name) return name.error();
    save.set_name(*name);
    return std::nullopt;
}

bool save_show(Work work, const Scene& scene, const SceneAccess& access, Loader& loader,
               std::function<void(Work)> done) {
    auto shared = std::make_shared<Work>(std::move(work));
    shared->rev = scene.scene_rev;
    return loader.submit([shared, scene, folder = access.show_folder, done = std::move(done)] {
        const v1::SaveShow& save = shared->message.save_show();
        const bool replace = save.replace() || save.name() == scene.show_name;
        std::string not_held;
        const auto written = write_show_file(folder, save.name(), text_of(scene, kMaxSavedBytes, not_held), replace);
        if (!written) shared->failure = written.error();
        if (!not_held.empty()) shared->loaded.warnings.push_back(not_held_warning(not_held));
        shared->read = true;
        done(std::move(*shared));
    });
}

std::optional<Error> check_show_edit(v1::ClientMessage& message, const SceneAccess& access) {
    const bool renames = message.has_rename_show();
    const std::string what = renames ? "rename_show" : "remove_show";
    if (access.show_folder.empty())
        return Error{"unsupported", what, "", "this server has no folder of shows: neither --shows nor --state"};
    const auto complete = [](std::string& name, const std::string& field) -> std::optional<Error> {
        auto checked = checked_show_name(name, field);
        if (!checked) return checked.error();
        name = std::move(*checked);
        return std::nullopt;
    };
    if (!renames) return complete(*message.mutable_remove_show()->mutable_name(), what + ".name");
    if (auto refused = complete(*message.mutable_rename_show()->mutable_name(), what + ".name")) return refused;
    return complete(*message.mutable_rename_show()->mutable_new_name(), what + ".new_name");
}

bool edit_shows(Work work, const SceneAccess& access, Loader& loader, std::function<void(Work)> done) {
    auto shared = std::make_shared<Work>(std::move(work));
    return loader.submit([shared, folder = access.show_folder, done = std::move(done)] {
        const v1::ClientMessage& message = shared->message;
        const auto edited = message.has_rename_show() ? rename_show_file(folder, message.rename_show().name(),
                                                                         message.rename_show().new_name())
                                                      : remove_show_file(folder, message.remove_show().name());
        if (!edited) shared->failure = edited.error();
        shared->read = true;
        done(std::move(*shared));
    });
}

std::string words_of(const Scene& scene) {
    std::string words = shortened_text(scene.asset->name, 200) + ": ";
    bool first = true;
    const auto add = [&](std::size_t count, const std::string& one) {
        if (count == 0 && one != "luminaire") return;
        words += (first ? "" : ", ") + std::to_string(count) + " " + one + (count == 1 ? "" : "s");
        first = false;
    };
    add(scene.lights.size(), "luminaire");
    add(scene.groups.size(), "group");
    add(scene.presets.size(), "preset");
    add(scene.cues ? scene.cues->size() : 0, "cue");
    add(scene.saved_views.size(), "view");
    add(scene.grids.size(), "grid");
    add(scene.observers.size(), "observer");
    if (show_file(scene).unsaved()) words += "; not saved";
    return words;
}

v1::Gels gels_reply(const Gels* gels) {
    v1::Gels reply;
    for (const auto& gel : all_gels(gels)) {
        v1::Gel& told = *reply.add_gels();
        told.set_name(gel->name);
        told.set_source(gel->source);
        for (const GelMeasurement& measured : gel->measured) {
            v1::GelMeasurement& one = *told.add_measured();
            for (int i = 0; i < 2; ++i) {
                one.add_of_xy(measured.of_xy[i]);
                one.add_xy(measured.xy[i]);
            }
            one.set_transmission_ratio(measured.transmission_ratio);
        }
    }
    return reply;
}

}  // namespace gonio
