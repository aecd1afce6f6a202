#include "server/session/roles.h"

#include "protocol/schema/session.pb.h"
#include "protocol/schema/state.pb.h"
#include "protocol/text/shortened_text.h"

namespace gonio {

void Roles::identify(std::uint32_t session, const v1::Identify& identify) {
    clients_[session] = {shortened_text(identify.client(), 128), identify.role() == "viewer"};
}

bool Roles::forget(std::uint32_t session) {
    clients_.erase(session);
    if (session == 0 || holder_ != session) return false;
    holder_ = 0;
    return true;
}

std::optional<Error> Roles::refuses_change(std::uint32_t session, const std::string& what) const {
    if (!leader_.empty()) return Error{"permission", what, leader_, "this server follows that one: change it there"};
    if (session == 0) return std::nullopt;
    const auto client = clients_.find(session);
    if (client != clients_.end() && !client->second.viewer) return std::nullopt;
    return Error{"permission", what, "viewer", "a viewer may look and ask, not change anything"};
}

Error Roles::held(const char* where) const {
    const v1::Control now = control();
    return {"held", where, now.name().empty() ? "client " + std::to_string(now.holder()) : now.name(),
            "client " + std::to_string(now.holder()) + " alone moves the camera now"};
}

std::optional<Error> Roles::acquire(std::uint32_t session, bool take, std::int64_t now_ns) {
    expire(now_ns);
    if (holder_ != 0 && holder_ != session && !take) return held("acquire_control");
    holder_ = session;
    until_ns_ = now_ns + kLeaseNs;
    return std::nullopt;
}

std::optional<Error> Roles::release(std::uint32_t session) {
    if (holder_ != 0 && holder_ != session) return held("release_control");
    holder_ = 0;
    return std::nullopt;
}

std::optional<Error> Roles::refuses_camera(std::uint32_t session, std::int64_t now_ns, const char* where) {
    if (holder_ == 0) return std::nullopt;
    if (holder_ != session) return held(where);
    until_ns_ = now_ns + kLeaseNs;
    return std::nullopt;
}

bool Roles::expire(std::int64_t now_ns) {
    if (holder_ == 0 || now_ns < until_ns_) return false;
    holder_ = 0;
    return true;
}

v1::Control Roles::control() const {
    v1::Control control;
    control.set_holder(holder_);
    const auto client = clients_.find(holder_);
    if (holder_ != 0 && client != clients_.end()) control.set_name(client->second.name);
    return control;
}

}  // namespace gonio
