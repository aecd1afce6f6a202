// The table of RFC 6455 cases: what is sent on a raw socket, and what the RFC's clause has the server do.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace gonio::conformance {

enum class Stage : std::uint8_t {
    connected,  // nothing is said yet: the steps are the handshake
    upgraded,   // after the handshake and Hello
    joined,     // after Identify and Ready
};

struct Step {
    enum class How : std::uint8_t {
        whole,   // in one write
        slowly,  // a segment for each byte
        finish,  // FIN: the client sends no more
        pause,   // 30 ms
    };
    std::string bytes;
    How how = How::whole;
};

struct Case {
    std::string name;    // unique, letters and digits
    std::string clause;  // of RFC 6455 where nothing else is said
    Stage stage = Stage::joined;
    std::vector<Step> steps;
    // What must come, in this order; "a | b": either. Pings of the server and news of the state may come in between.
    //   101, 400, …          status of the answer to the handshake; 4xx: any
    //   +Name: value, -Name  a header that the answer has, one that it has not
    //   echo TEXT            the answer to echo_request(TEXT)
    //   refusal CODE         an answer `result` with this code
    //   pong PAYLOAD         and pongs PAYLOAD: others before it
    //   ping                 from the server
    //   close CODE           0: without a code
    //   end                  the server closes the TCP connection
    // After the last one the connection must still answer, unless it was a close, an end or a status other than 101.
    std::vector<std::string> expected;
    std::string subprotocol = "gonio.v1.json";
};

// A request whose answer repeats `text`: `{"request_id":7,"profile":{"light":TEXT}}`.
std::string echo_request(const std::string& text);

// `port` goes into the handshakes.
std::vector<Case> handshake_cases(std::uint16_t port);
std::vector<Case> framing_cases();
std::vector<Case> text_cases();
std::vector<Case> closing_cases();
std::vector<Case> limit_cases();

std::vector<Case> all_cases(std::uint16_t port);

}  // namespace gonio::conformance
