// Who is connected and what they may do: viewers change nothing, and one client may hold the camera for itself. Pure:
// the time is a parameter. Render thread.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "ies/core/result.h"
#include "protocol/schema/messages.h"

namespace gonio {

inline constexpr std::int64_t kLeaseNs = 30'000'000'000;  // without a word of the holder the camera is free again

class Roles {
public:
    // This server follows the one of this address: nobody changes anything here.
    void set_leader(std::string leader) { leader_ = std::move(leader); }

    // The session has shown itself. Until then, and for HTTP requests for ever, it may only ask.
    void identify(std::uint32_t session, const v1::Identify& identify);
    // Result: whether the camera's holder changed.
    bool forget(std::uint32_t session);
    // Result: why the session may not change anything ("permission", with the leader's address as value where there is
    // one). what: the field that asks for it. Session 0 is the server itself: consoles, fader boxes.
    std::optional<Error> refuses_change(std::uint32_t session, const std::string& what) const;

    // The lease of the camera. take: also from a holder. Result: why not ("held", with the holder's name as value).
    std::optional<Error> acquire(std::uint32_t session, bool take, std::int64_t now_ns);
    std::optional<Error> release(std::uint32_t session);
    // where: the command. Result: why the session may not move the camera ("held"); the holder's lease begins anew.
    std::optional<Error> refuses_camera(std::uint32_t session, std::int64_t now_ns, const char* where = "set_camera");
    // Result: whether the lease has just ended.
    bool expire(std::int64_t now_ns);
    std::uint32_t holder() const { return holder_; }  // 0: nobody
    v1::Control control() const;

private:
    struct Client {
        std::string name;
        bool viewer = false;
    };
    Error held(const char* where) const;

    std::map<std::uint32_t, Client> clients_;  // as many as the HTTP server lets in
    std::string leader_;                       // empty: none
    std::uint32_t holder_ = 0;
    std::int64_t until_ns_ = 0;
};

}  // namespace gonio
