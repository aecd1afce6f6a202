// A client on a raw socket for the tests of the front: it can say what no library would, and sees every byte.
#pragma once

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <functional>
#include <optional>
#include <string>

#include "protocol/schema/codec.h"
#include "protocol/schema/frame_header.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/session.pb.h"

namespace gonio::test {

class Client {
public:
    explicit Client(std::uint16_t port, int receive_buffer_bytes = 0, const std::function<void()>& before_connect = {})
        : port_(port) {
        socket_ = ::socket(AF_INET, SOCK_STREAM, 0);
        if (receive_buffer_bytes > 0)
            ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_buffer_bytes, sizeof receive_buffer_bytes);
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_port = htons(port);
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        if (before_connect) before_connect();
        EXPECT_EQ(::connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    }
    ~Client() { ::close(socket_); }
    Client(const Client&) = delete;
    Client& operator=(const Client&) = delete;

    void send(const std::string& bytes) {
        for (std::size_t sent = 0; sent < bytes.size();) {
            const ssize_t n = ::send(socket_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
            if (n <= 0) return;
            sent += static_cast<std::size_t>(n);
        }
    }
    // Waits for more bytes. Result: false on the end of the connection or when the time is over.
    bool receive(int timeout_ms = 3000) {
        pollfd poll{socket_, POLLIN, 0};
        if (::poll(&poll, 1, timeout_ms) <= 0) return false;
        char bytes[65536];
        const ssize_t n = ::recv(socket_, bytes, sizeof bytes, 0);
        if (n <= 0) {
            closed = true;
            return false;
        }
        received.append(bytes, static_cast<std::size_t>(n));
        return true;
    }
    bool receive_until(const std::string& marker, int timeout_ms = 3000) {
        while (received.find(marker) == std::string::npos)
            if (!receive(timeout_ms)) return false;
        return true;
    }
    bool receive_end(int timeout_ms = 3000) {
        while (receive(timeout_ms)) {
        }
        return closed;
    }
    std::string take(std::size_t count) {
        while (received.size() < count)
            if (!receive()) return {};
        std::string bytes = received.substr(0, count);
        received.erase(0, count);
        return bytes;
    }

    // ---- HTTP. Result: the response's status; head and body are kept.
    int get(const std::string& target, const std::string& headers = "", const std::string& host = "",
            const std::string& method = "GET") {
        send(method + " " + target + " HTTP/1.1\r\nHost: " + (host.empty() ? own_host() : host) + "\r\n" + headers +
             "\r\n");
        return read_response(method != "HEAD");
    }
    int read_response(bool with_body = true) {
        if (!receive_until("\r\n\r\n")) return 0;
        const std::size_t end = received.find("\r\n\r\n") + 4;
        head = received.substr(0, end);
        received.erase(0, end);
        const std::size_t length = head.find("Content-Length: ");
        body = with_body && length != std::string::npos ? take(std::stoul(head.substr(length + 16))) : "";
        return std::stoi(head.substr(9, 3));
    }
    std::string own_host() const { return "127.0.0.1:" + std::to_string(port_); }
    std::string head, body, received;
    bool closed = false;

    // ---- WebSocket
    int upgrade(std::string_view subprotocol, const std::string& headers = "", const std::string& host = "") {
        encoding = subprotocol == kSubprotocolProto ? Encoding::proto : Encoding::json;
        return get("/v1/ws",
                   "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                   "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Protocol: " +
                       std::string(subprotocol) + "\r\n" + headers,
                   host);
    }
    void send_frame(int opcode, const std::string& payload) { send(frame(opcode, payload)); }
    static std::string frame(int opcode, const std::string& payload) {
        std::string frame(1, static_cast<char>(0x80 | opcode));
        if (payload.size() < 126) {
            frame += static_cast<char>(0x80 | payload.size());
        } else {
            const bool wide = payload.size() > 0xffff;
            frame += static_cast<char>(0x80 | (wide ? 127 : 126));
            for (int byte = wide ? 7 : 1; byte >= 0; --byte)
                frame += static_cast<char>(payload.size() >> (8 * byte) & 0xff);
        }
        frame += std::string("\0\0\0\0", 4);  // a mask of zeros
        return frame + payload;
    }
    struct Frame {
        int opcode = -1;  // -1: nothing came
        std::string payload;
        int close_code() const {
            if (opcode != 8 || payload.size() < 2) return 0;
            return static_cast<unsigned char>(payload[0]) << 8 | static_cast<unsigned char>(payload[1]);
        }
        std::uint32_t seq() const { return header().seq; }
        FrameHeader header() const {
            auto decoded = decode_frame_header(std::as_bytes(std::span(payload.data(), payload.size())));
            return decoded ? *decoded : FrameHeader{};
        }
    };
    // Result: the next frame; pings, which measure the link, are counted and left out unless they are looked for.
    Frame read_frame(int timeout_ms = 3000) {
        for (;;) {
            const Frame frame = read_any_frame(timeout_ms);
            if (frame.opcode != 9 || keeps_pings) return frame;
            ++pings;
        }
    }
    Frame read_any_frame(int timeout_ms = 3000) {
        while (received.size() < 2)
            if (!receive(timeout_ms)) return {};
        std::size_t length = static_cast<unsigned char>(received[1]) & 0x7f;
        const std::size_t extra = length == 126 ? 2 : length == 127 ? 8 : 0;
        const std::string start = take(2 + extra);
        if (extra) length = 0;
        for (std::size_t i = 0; i < extra; ++i) length = length << 8 | static_cast<unsigned char>(start[2 + i]);
        return {start[0] & 0x0f, length ? take(length) : ""};
    }
    // Result: the next control message; video frames on the way are counted and kept in last_video.
    std::optional<v1::ServerMessage> read_message(int timeout_ms = 3000) {
        for (;;) {
            const Frame frame = read_frame(timeout_ms);
            if (frame.opcode == 9) continue;
            if (frame.opcode == 2 && !frame.payload.empty() && frame.payload[0] == 2) {
                last_video = frame;
                ++videos;
                continue;
            }
            last = frame;
            if (frame.opcode != 1 && frame.opcode != 2) return std::nullopt;
            auto message = decode_server_message(
                encoding, std::string_view(frame.payload).substr(encoding == Encoding::proto ? 1 : 0));
            if (!message) return std::nullopt;
            return *message;
        }
    }
    void say(const v1::ClientMessage& message) {
        std::string bytes = encode_message(encoding, message);
        if (encoding == Encoding::proto) bytes.insert(0, 1, '\x01');
        send_frame(encoding == Encoding::proto ? 2 : 1, bytes);
    }
    void identify(bool video, bool state, const std::string& token = "") {
        v1::ClientMessage message;
        message.mutable_identify()->set_client("test");
        message.mutable_identify()->set_video(video);
        message.mutable_identify()->set_state(state);
        message.mutable_identify()->set_token(token);
        say(message);
    }
    // Result: the next frame where it is a picture, which is acknowledged; a ping is answered.
    std::optional<Frame> read_picture(int timeout_ms) {
        Frame frame = read_frame(timeout_ms);
        if (frame.opcode == 9) send_frame(10, frame.payload);
        if (frame.opcode != 2 || frame.payload.empty() || frame.payload[0] != 2) return std::nullopt;
        acknowledge(frame.seq());
        return frame;
    }
    void acknowledge(std::uint32_t seq) {
        v1::ClientMessage message;
        message.mutable_frame_ack()->set_seq(seq);
        say(message);
    }
    // Upgrades, identifies and reads Hello and Ready.
    v1::Ready join(std::string_view subprotocol, bool video, bool state) {
        EXPECT_EQ(upgrade(subprotocol), 101);
        const auto hello = read_message();
        EXPECT_TRUE(hello && hello->has_hello());
        identify(video, state);
        const auto ready = read_message();
        EXPECT_TRUE(ready && ready->has_ready());
        return ready ? ready->ready() : v1::Ready();
    }
    Encoding encoding = Encoding::json;
    Frame last, last_video;
    int videos = 0, pings = 0;
    bool keeps_pings = false;

private:
    std::uint16_t port_;
    int socket_ = -1;
};

}  // namespace gonio::test
