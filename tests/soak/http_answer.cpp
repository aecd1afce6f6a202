#include "tests/soak/http_answer.h"

#include "tests/conformance/raw_peer.h"

namespace gonio::soak {

std::pair<int, std::string> http_answer(std::uint16_t port, const std::string& request) {
    conformance::RawPeer peer(port);
    const auto until = conformance::Clock::now() + std::chrono::seconds(20);
    peer.send(request);
    const std::string head = peer.read_head(until);
    const std::size_t length = head.find("Content-Length: ");
    if (!head.starts_with("HTTP/1.1 ") || length == std::string::npos) return {0, ""};
    return {std::stoi(head.substr(9)), peer.read_bytes(std::stoul(head.substr(length + 16)), until)};
}

std::pair<int, std::string> put_upload(std::uint16_t port, const std::string& name, const std::string& content) {
    return http_answer(port, "PUT /v1/uploads/" + name + " HTTP/1.1\r\nHost: localhost\r\nContent-Length: " +
                                 std::to_string(content.size()) + "\r\n\r\n" + content);
}

}  // namespace gonio::soak
