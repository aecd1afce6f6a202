// Bytes <-> protocol messages, both encodings. Pure functions, any thread.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "ies/core/result.h"
#include "protocol/schema/messages.h"

namespace gonio {

enum class Encoding : unsigned char { proto, json };

inline constexpr std::string_view kSubprotocolProto = "gonio.v1.proto";
inline constexpr std::string_view kSubprotocolJson = "gonio.v1.json";
inline constexpr std::size_t kMaxMessageBytes = 2u << 20;  // a client message beyond this closes the connection (1009)
inline constexpr std::size_t kMaxServerMessageBytes = 256u << 20;  // a server's may hold the largest captured EXR

// bytes: the message body (binary: without the leading kind byte). Errors: "bad_message" with what is known of the
// place, "unsupported" where no member of the oneof is set.
Result<v1::ClientMessage> decode_client_message(Encoding encoding, std::string_view bytes);
Result<v1::ServerMessage> decode_server_message(Encoding encoding, std::string_view bytes);

// Result: the request_id of a message that could not be decoded, as far as it can be read, else 0; for the answer.
std::uint32_t peek_request_id(Encoding encoding, std::string_view bytes);

// Result: the refusal that tells a client of the error; scene_rev is left to the caller.
v1::Result refusal(const Error& error);

// Result: the message body; JSON is proto3 JSON with the original field names and defaults printed.
std::string encode_message(Encoding encoding, const google::protobuf::Message& message);

}  // namespace gonio
