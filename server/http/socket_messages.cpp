#include "server/http/socket_messages.h"

#include "protocol/schema/frame_header.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/session.pb.h"

namespace gonio {

v1::ServerMessage hello_message(const HttpOptions& options, bool has_h264) {
    v1::ServerMessage message;
    v1::Hello& hello = *message.mutable_hello();
    hello.set_server(options.server_name);
    hello.set_renderer(options.renderer);
    hello.set_encoder(has_h264 ? options.encoder : "mjpeg");
    if (has_h264) hello.add_features("h264");
    for (const char* feature : {"mjpeg", "still"}) hello.add_features(feature);
    return message;
}

v1::ServerMessage goodbye_message(std::uint32_t reconnect_after_ms) {
    v1::ServerMessage message;
    message.mutable_goodbye()->set_reason("The server stops.");
    message.mutable_goodbye()->set_reconnect_after_ms(reconnect_after_ms);
    return message;
}

v1::ServerMessage refusal_message(std::uint32_t request_id, const Error& error, std::chrono::milliseconds retry) {
    v1::ServerMessage message;
    message.set_request_id(request_id);
    *message.mutable_result() = refusal(error);
    message.mutable_result()->set_retry_after_ms(static_cast<std::uint32_t>(retry.count()));
    return message;
}

std::string_view body_of(Encoding encoding, std::string_view bytes) {
    return encoding == Encoding::proto && !bytes.empty() ? bytes.substr(1) : bytes;
}

Result<v1::ClientMessage> decode_frame(Encoding encoding, std::string_view bytes, bool is_text) {
    if (encoding == Encoding::json) {
        if (!is_text) return Error{"bad_message", "", "", "Messages of gonio.v1.json are text frames."};
    } else if (is_text || bytes.empty() || static_cast<unsigned char>(bytes[0]) != kBinaryControl) {
        return Error{"bad_message", "byte 0", "", "Messages of gonio.v1.proto are binary frames that begin with 1."};
    }
    return decode_client_message(encoding, body_of(encoding, bytes));
}

}  // namespace gonio
