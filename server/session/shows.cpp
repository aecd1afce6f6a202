#include "server/session/shows.h"

#include <utility>

#include "protocol/schema/codec.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/library.pb.h"
#include "protocol/schema/show.pb.h"
#include "server/show/saved_show.h"
#include "server/show/show_folder.h"

namespace gonio {
namespace {

std::string text_of(const Scene& scene) {
    ProfileTexts texts;
    return write_show(show_of(scene, texts));
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
    auto text = name.empty() ? Result<std::string>(text_of(scene)) : read_show_file(folder, name, kMaxShownBytes);
    if (!text) return text.error();
    if (text->size() > kMaxShownBytes)
        return Error{"too_large", "shows.text_of", name,
                     "a client is sent at most 32 MiB: the show has " + std::to_string(text->size()) + " bytes"};
    shows->set_text_of(name);
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
        const auto written = write_show_file(folder, save.name(), text_of(scene), replace);
        if (!written) shared->failure = written.error();
        shared->read = true;
        done(std::move(*shared));
    });
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
