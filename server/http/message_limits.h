// Limits of the HTTP server on what a message asks for, before anybody else sees it. Pure.
#pragma once

#include <algorithm>
#include <optional>

#include "ies/core/result.h"
#include "protocol/schema/gonio.pb.h"
#include "server/http/http_limits.h"

namespace gonio {

// Whether its answer is what was asked for, and not just whether it was done.
inline bool is_query(const v1::ClientMessage& message) {
    using Message = v1::ClientMessage;
    constexpr Message::MessageCase queries[] = {
        Message::kGetState, Message::kMeter,   Message::kCapture, Message::kReport,   Message::kStats,
        Message::kProfile,  Message::kSources, Message::kPatch,   Message::kSurfaces, Message::kLearn,
        Message::kPick,     Message::kShows,   Message::kGels,    Message::kGrid,     Message::kUgr,
        Message::kFollow,   Message::kTargets, Message::kBeam,    Message::kLibrary,  Message::kLuxReport,
        Message::kIsolux};
    return std::ranges::find(queries, message.message_case()) != std::end(queries);
}

// Result: why the message is refused; nothing if it is not.
inline std::optional<Error> over_limit(const HttpLimits& limits, const v1::ClientMessage& message) {
    if (message.request_id() == 0 && is_query(message))
        return Error{"invalid_argument", "request_id", "0", "must be another number: the answer goes by it"};
    const auto side = static_cast<std::uint32_t>(limits.side_px);
    const auto refusal = [&](const char* field, std::uint32_t width, std::uint32_t height) -> std::optional<Error> {
        if (width <= side && height <= side) return std::nullopt;
        return Error{"invalid_argument", field, std::to_string(width) + "x" + std::to_string(height),
                     "must be at most " + std::to_string(side) + " pixels a side here"};
    };
    if (message.has_capture())
        return refusal("capture.width_px", message.capture().width_px(), message.capture().height_px());
    if (message.has_command() && message.command().has_set_size())
        return refusal("set_size.width_px", message.command().set_size().width_px(),
                       message.command().set_size().height_px());
    return std::nullopt;
}

}  // namespace gonio
