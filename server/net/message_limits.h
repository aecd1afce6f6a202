// Limits of the front on what a message asks for, before anybody else sees it. Pure.
#pragma once

#include <optional>

#include "ies/result.h"
#include "protocol/gonio.pb.h"
#include "server/net/front_limits.h"

namespace gonio {

// Result: why the message is refused; nothing if it is not.
inline std::optional<Error> over_limit(const FrontLimits& limits, const v1::ClientMessage& message) {
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
