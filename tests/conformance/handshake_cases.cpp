// RFC 6455 section 4: the opening handshake; and what RFC 7230 has a server do with the HTTP request that it is.
#include "tests/conformance/cases.h"
#include "tests/conformance/raw_peer.h"

namespace gonio::conformance {
namespace {

using Lines = std::vector<std::string>;

constexpr const char* kRequestLine = "GET /v1/ws HTTP/1.1";
constexpr const char* kConnection = "Connection: Upgrade";
constexpr const char* kUpgrade = "Upgrade: websocket";
constexpr const char* kVersion = "Sec-WebSocket-Version: 13";
constexpr const char* kKey = "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==";
constexpr const char* kProtocol = "Sec-WebSocket-Protocol: gonio.v1.json";

// Result: the correct request with one line replaced ("" removes it) and lines added.
std::string request(const std::string& host, const std::string& line = "", const std::string& by = "",
                    const Lines& added = {}) {
    Lines lines = {kRequestLine, host, kConnection, kUpgrade, kVersion, kKey, kProtocol};
    std::string text;
    for (const std::string& one : lines) {
        const std::string written = one == line ? by : one;
        if (!written.empty()) text += written + "\r\n";
    }
    for (const std::string& one : added) text += one + "\r\n";
    return text + "\r\n";
}

}  // namespace

std::vector<Case> handshake_cases(std::uint16_t port) {
    const std::string authority = "127.0.0.1:" + std::to_string(port), host = "Host: " + authority;
    std::vector<Case> cases;
    const auto add = [&](std::string name, std::string clause, std::string bytes, std::vector<std::string> expected,
                         Step::How how = Step::How::whole) {
        cases.push_back(
            {std::move(name), std::move(clause), Stage::connected, {{std::move(bytes), how}}, std::move(expected)});
    };
    const auto with = [&](const std::string& line, const std::string& by, const Lines& added = {}) {
        return request(host, line, by, added);
    };

    add("HandshakeOfTheRfc", "1.3, 4.2.2-5", with("", ""),
        {"101", "+Upgrade: websocket", "+Connection: upgrade", "+Sec-WebSocket-Accept: s3pPLMBiTxaQ9kYGzzhZRbK+xOo=",
         "+Sec-WebSocket-Protocol: gonio.v1.json", "-Sec-WebSocket-Extensions"});
    add("KeyOfZeros", "4.2.2-5.4", with(kKey, "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA=="),
        {"101", "+Sec-WebSocket-Accept: ICX+Yqv66kxgM0FcWaLWlFLwTAI="});
    add("KeyOfHighBytes", "4.2.2-5.4", with(kKey, "Sec-WebSocket-Key: 8PHy8/T19vf4+fr7/P3+/w=="),
        {"101", "+Sec-WebSocket-Accept: o1HBjBrgy9KLkiDEDur3dyqqLEs="});
    add("ARequestByteByByte", "4.2.1", with("", ""), {"101"}, Step::How::slowly);
    add("UpgradeInAnyCase", "4.2.1-3", with(kUpgrade, "Upgrade: WebSocket"), {"101"});
    add("UpgradeAmongOthers", "4.2.1-3", with(kUpgrade, "Upgrade: h2c, websocket"), {"101"});
    add("ConnectionAmongOthers", "4.2.1-4", with(kConnection, "Connection: keep-alive, uPGRADE"), {"101"});
    add("HeaderNamesInAnyCase", "RFC 7230 3.2", with(kKey, "SEC-WEBSOCKET-KEY: dGhlIHNhbXBsZSBub25jZQ=="), {"101"});
    add("UnknownHeadersAreIgnored", "4.2.1", with("", "", {"X-Whatever: 1", "Cookie: a=b"}), {"101"});
    add("WhitespaceAroundValues", "RFC 7230 3.2.4", with(kVersion, "Sec-WebSocket-Version: \t 13  "), {"101"});
    add("NoWhitespaceBeforeValues", "RFC 7230 3.2.4", with(kVersion, "Sec-WebSocket-Version:13"), {"101"});

    add("PostIsNoHandshake", "4.2.1-1", with(kRequestLine, "POST /v1/ws HTTP/1.1"), {"4xx"});
    add("HeadIsNoHandshake", "4.2.1-1", with(kRequestLine, "HEAD /v1/ws HTTP/1.1"), {"4xx"});
    add("Http10IsNoHandshake", "4.2.1-1", with(kRequestLine, "GET /v1/ws HTTP/1.0"), {"4xx | 505"});
    add("NoUpgrade", "4.2.1-3", with(kUpgrade, ""), {"4xx"});
    add("UpgradeToSomethingElse", "4.2.1-3", with(kUpgrade, "Upgrade: websockets"), {"4xx"});
    add("NoConnection", "4.2.1-4", with(kConnection, ""), {"4xx"});
    add("ConnectionToSomethingElse", "4.2.1-4", with(kConnection, "Connection: close"), {"4xx"});
    add("NoVersion", "4.2.1-6", with(kVersion, ""), {"4xx"});
    for (const char* version : {"0", "8", "12", "14", "255", "thirteen"})
        add("Version" + std::string(version), "4.2.2-4, 4.4",
            with(kVersion, "Sec-WebSocket-Version: " + std::string(version)),
            {"426 | 400", "+Sec-WebSocket-Version: 13"});
    add("TwoVersions", "11.3.5", with("", "", {"Sec-WebSocket-Version: 8"}), {"4xx"});
    add("NoKey", "4.2.1-5", with(kKey, ""), {"4xx"});
    add("EmptyKey", "4.2.1-5, 11.3.1", with(kKey, "Sec-WebSocket-Key:"), {"4xx"});
    add("KeyOf15Bytes", "4.2.1-5", with(kKey, "Sec-WebSocket-Key: AAECAwQFBgcICQoLDA0O"), {"4xx"});
    add("KeyOf17Bytes", "4.2.1-5", with(kKey, "Sec-WebSocket-Key: AAECAwQFBgcICQoLDA0ODxA="), {"4xx"});
    add("KeyOf64Bytes", "4.2.1-5", with(kKey, "Sec-WebSocket-Key: " + std::string(86, 'A') + "=="), {"4xx"});
    add("KeyThatIsNotBase64", "4.2.1-5, 11.3.1", with(kKey, "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZ!=="), {"4xx"});
    add("TwoKeys", "11.3.1", with("", "", {"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA=="}), {"4xx"});

    add("NoSubprotocolIsRefusedHere", "4.2.2-4 (/subprotocol/)", with(kProtocol, ""), {"400"});
    add("UnknownSubprotocolIsRefusedHere", "4.2.2-4 (/subprotocol/)", with(kProtocol, "Sec-WebSocket-Protocol: chat"),
        {"400"});
    add("SubprotocolsAreCaseSensitive", "1.9, 11.5", with(kProtocol, "Sec-WebSocket-Protocol: GONIO.V1.JSON"), {"400"});
    add("TheFirstKnownSubprotocolWins", "4.1-10, 4.2.2-5.5",
        with(kProtocol, "Sec-WebSocket-Protocol: chat, gonio.v1.json,gonio.v1.proto"),
        {"101", "+Sec-WebSocket-Protocol: gonio.v1.json"});
    add("SubprotocolsInTwoHeaders", "11.3.4",
        with(kProtocol, "Sec-WebSocket-Protocol: chat", {"Sec-WebSocket-Protocol: gonio.v1.json"}),
        {"101", "+Sec-WebSocket-Protocol: gonio.v1.json"});
    add("OfferedExtensionsAreDeclined", "4.2.2-5.6, 9.1",
        with("", "", {"Sec-WebSocket-Extensions: permessage-deflate; client_max_window_bits, x-frob"}),
        {"101", "-Sec-WebSocket-Extensions"});

    add("NoHost", "4.2.1-2", request(""), {"400"});
    add("TwoHosts", "4.2.1-2, RFC 7230 5.4", with("", "", {"Host: localhost"}), {"400"});
    add("AForeignHost", "4.2.1-2, 10.2", request("Host: evil.example"), {"403 | 421"});
    add("AForeignOrigin", "4.2.2-4, 10.2", with("", "", {"Origin: http://evil.example"}), {"403"});
    add("AnOpaqueOrigin", "4.2.2-4, 10.2", with("", "", {"Origin: null"}), {"403"});
    add("TheOwnOrigin", "4.2.2-4, 10.2", with("", "", {"Origin: http://" + authority}), {"101"});
    add("TwoOrigins", "RFC 6454 7.3", with("", "", {"Origin: http://" + authority, "Origin: http://evil.example"}),
        {"4xx"});
    add("AnAbsoluteTarget", "4.2.1-1, RFC 7230 5.3.2",
        with(kRequestLine, "GET http://" + authority + "/v1/ws HTTP/1.1"), {"101"});
    add("AnUnknownResource", "4.2.2-4 (/resource name/)", with(kRequestLine, "GET /chat HTTP/1.1"), {"404"});

    add("AHeaderOf7KiB", "4.2.1, 10.4", with("", "", {"X-Long: " + std::string(7000, 'x')}), {"101"});
    add("AHeaderOf9KiB", "10.4, RFC 6585 5", with("", "", {"X-Long: " + std::string(9000, 'x')}), {"431", "end"});
    add("ThousandHeaders", "10.4, RFC 6585 5", with("", "", Lines(1000, "X-Many: 1234567")), {"431", "end"});
    add("WhitespaceBeforeTheColon", "RFC 7230 3.2.4", with(kVersion, "Sec-WebSocket-Version : 13"), {"400"});
    add("NoColon", "RFC 7230 3.2", with("", "", {"Garbage"}), {"400"});
    add("ANulInAHeader", "RFC 7230 3.2", with("", "", {std::string("X: a\0b", 6)}), {"400"});
    add("ABody", "4.1-1, RFC 7230 3.3", with("", "", {"Content-Length: 4"}) + "body", {"4xx"});
    add("FramesBeforeTheAnswer", "4.1 (the client must wait)", with("", "") + frame(kPing, "early"), {"4xx"});
    add("AnotherProtocolAltogether", "4.2.1", "\x16\x03\x01\x02 hello\r\n\r\n", {"400", "end"});
    cases.push_back({"HalfARequest",
                     "7.1.7",
                     Stage::connected,
                     {{"GET /v1/ws HTTP/1.1\r\nHost: loc"}, {"", Step::How::finish}},
                     {"400 | end", "end"}});
    cases.push_back({"NothingAtAll", "10.3", Stage::connected, {}, {"end"}});
    return cases;
}

}  // namespace gonio::conformance
