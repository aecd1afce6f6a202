// The target of an HTTP request, as it stands in the request line, -> a path, its parameters, and what they ask for.
// Pure functions; nothing here touches a file.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "ies/core/result.h"
#include "protocol/schema/messages.h"

namespace gonio {

inline constexpr std::size_t kMaxTargetBytes = 4096;
inline constexpr std::size_t kMaxParameters = 16;

struct HttpParameter {
    std::string name, value;
};

struct HttpTarget {
    std::optional<std::string>
        authority;     // of "http://HOST:PORT/…", which stands above the Host header (RFC 9112, 3.2.2)
    std::string path;  // decoded; begins with '/'
    std::vector<HttpParameter> query;  // decoded, in the order in which they stand
};

// target: origin-form or absolute-form. What is decoded is UTF-8 without control characters; '+' stays '+'.
// Errors: "bad_target" with the offending part; "too_large".
Result<HttpTarget> parse_target(std::string_view target);

// Result: whether the path is /v1/frame.png, .jpg or .exr, or /v1/scene.glb or .mvr: what is made for the request.
bool is_still(const HttpTarget& target);
// target: is_still(). Result: what its parameters after_rev, size, view, quality, bounces, noise and openings ask for;
// of a scene's file after_rev alone.
// Whether such a view or size exists is the scene's business. Errors: "invalid_argument" with the parameter's name and
// value, where it is unknown, repeated, empty or no number.
Result<v1::CaptureQuery> still_query(const HttpTarget& target);

// Result: the NAME of /v1/uploads/NAME as it stands there; nothing for other paths.
std::optional<std::string> upload_name(const HttpTarget& target);

// Result: the SHA-256 of /v1/blobs/SHA256 as it stands there; nothing for other paths.
std::optional<std::string> blob_name(const HttpTarget& target);

}  // namespace gonio
