#include "server/session/replies.h"

#include "protocol/schema/codec.h"
#include "protocol/schema/gonio.pb.h"
#include "server/scene/scene.h"

namespace gonio {

void Replies::answer(const Work& work, v1::ServerMessage message) const {
    if (work.message.request_id() == 0) return;
    message.set_request_id(work.message.request_id());
    send_(work.session, std::move(message));
}

void Replies::ok(const Work& work, std::vector<std::string> warnings, std::string replaced,
                 const std::vector<std::string>& notes) const {
    v1::ServerMessage message;
    message.mutable_result()->set_code("ok");
    message.mutable_result()->set_scene_rev(scene_.scene_rev);
    for (std::string& warning : warnings) message.mutable_result()->add_warnings(std::move(warning));
    for (const std::string& note : notes) message.mutable_result()->add_notes(note);
    if (!replaced.empty()) message.mutable_result()->set_replaced(std::move(replaced));
    answer(work, std::move(message));
}

void Replies::refuse(const Work& work, const Error& error) {
    ++refused_;
    v1::ServerMessage message = message_of(&v1::ServerMessage::mutable_result, refusal(error));
    message.mutable_result()->set_scene_rev(scene_.scene_rev);
    answer(work, std::move(message));
}

}  // namespace gonio
