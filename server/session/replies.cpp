#include "server/session/replies.h"

#include "protocol/schema/codec.h"

namespace gonio {

void Replies::answer(const Work& work, v1::ServerMessage message) const {
    if (work.message.request_id() == 0) return;
    message.set_request_id(work.message.request_id());
    send_(work.session, std::move(message));
}

void Replies::ok(const Work& work, std::vector<std::string> warnings) const {
    v1::ServerMessage message;
    message.mutable_result()->set_code("ok");
    message.mutable_result()->set_scene_rev(scene_.scene_rev);
    for (std::string& warning : warnings) message.mutable_result()->add_warnings(std::move(warning));
    answer(work, std::move(message));
}

void Replies::refuse(const Work& work, const Error& error) {
    ++refused_;
    v1::ServerMessage message = message_of(&v1::ServerMessage::mutable_result, refusal(error));
    message.mutable_result()->set_scene_rev(scene_.scene_rev);
    answer(work, std::move(message));
}

v1::ProfileReply profile_reply(const Light& light) {
    const ies::PhotometricWeb& web = light.profile->photometry.web;
    v1::ProfileReply reply;
    reply.set_light(light.name);
    reply.set_profile(light.profile->name);
    reply.set_max_cd(light.profile->peak_cd);
    reply.set_flux_lm(light.profile->flux_lm);
    for (int v = 0; v <= 180; v += 2) {
        const auto at = [&](double h) {
            return ies::intensity(web, ies::direction_of(ies::Goniometer::type_c, Angle::degrees(v), Angle::degrees(h)))
                .in(cd);
        };
        reply.add_v_deg(v);
        reply.add_c0_cd(at(0));
        reply.add_c90_cd(at(90));
        reply.add_c180_cd(at(180));
        reply.add_c270_cd(at(270));
    }
    return reply;
}

}  // namespace gonio
