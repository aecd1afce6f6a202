// Every RFC 6455 case against the real front, which a test's daemon stands behind. All cases run at once on a few
// threads, because some wait for timeouts; then each is a test of its own.
#include <gtest/gtest.h>

#include <atomic>
#include <set>
#include <thread>

#include "protocol/schema/gonio.pb.h"
#include "tests/conformance/cases.h"
#include "tests/conformance/played_daemon.h"
#include "tests/conformance/raw_peer.h"

namespace gonio::conformance {

std::string echo_request(const std::string& text) {
    return R"({"request_id":7,"profile":{"light":")" + text + R"("}})";
}

std::vector<Case> all_cases(std::uint16_t port) {
    std::vector<Case> cases = handshake_cases(port);
    for (const auto& part : {framing_cases(), text_cases(), closing_cases(), limit_cases()})
        cases.insert(cases.end(), part.begin(), part.end());
    return cases;
}

namespace {

using namespace std::chrono_literals;

constexpr auto kPatience = 5s;
constexpr auto kPause = 30ms;
constexpr const char* kAlive = "still here";

std::vector<std::string> alternatives(const std::string& expected) {
    std::vector<std::string> parts;
    for (std::size_t from = 0;;) {
        const std::size_t bar = expected.find(" | ", from);
        parts.push_back(expected.substr(from, bar == std::string::npos ? bar : bar - from));
        if (bar == std::string::npos) return parts;
        from = bar + 3;
    }
}

std::string shortened(const std::string& text) {
    std::string shown;
    for (const char c : text.substr(0, 80)) {
        char code[8];
        std::snprintf(code, sizeof code, c >= 0x20 && c < 0x7f ? "%c" : "\\x%02x", static_cast<unsigned char>(c));
        shown += code;
    }
    return text.size() > 80 ? shown + "… (" + std::to_string(text.size()) + " bytes)" : shown;
}

// Result: what a frame of the server means in the words of Case::expected; "" where it may come at any time.
std::string meaning(const HeardFrame& heard, const std::string& subprotocol) {
    if (heard.masked) return "a masked frame";                 // 5.1: a server must not mask
    if (heard.rsv != 0) return "a frame with a reserved bit";  // no extension is negotiated
    if (!heard.fin) return "a fragment";                       // this server never fragments
    if (heard.opcode == kPing) return "ping";
    if (heard.opcode == kPong) return "pong " + heard.payload;
    if (heard.opcode == kClose) {
        if (heard.payload.empty()) return "close 0";
        if (heard.payload.size() < 2) return "a close of one byte";
        return "close " + std::to_string(static_cast<unsigned char>(heard.payload[0]) << 8 |
                                         static_cast<unsigned char>(heard.payload[1]));
    }
    const bool json = subprotocol == kSubprotocolJson;
    if (heard.opcode != (json ? kText : kBinary)) return "opcode " + std::to_string(heard.opcode);
    const auto message = decode_server_message(json ? Encoding::json : Encoding::proto,
                                               std::string_view(heard.payload).substr(json ? 0 : 1));
    if (!message) return "a message that cannot be decoded";
    if (message->has_state_changed()) return "";
    if (message->has_hello()) return "hello";
    if (message->has_ready()) return "ready";
    if (message->has_profile()) return "echo " + message->profile().light();
    if (message->has_result()) return "refusal " + message->result().code();
    return "another message";
}

// One conversation. Result: what went wrong, "" for nothing.
class Conversation {
public:
    Conversation(const Case& one, std::uint16_t port) : case_(one), port_(port), peer_(port) {}

    std::string run() {
        if (!peer_.connected()) return "cannot connect";
        if (case_.stage != Stage::connected) {
            const std::string failure = join();
            if (!failure.empty()) return failure;
        }
        for (const Step& step : case_.steps) {
            switch (step.how) {
                case Step::How::whole:
                    peer_.send(step.bytes);
                    break;
                case Step::How::slowly:
                    peer_.send_slowly(step.bytes);
                    break;
                case Step::How::finish:
                    peer_.send_end();
                    break;
                case Step::How::pause:
                    std::this_thread::sleep_for(kPause);
                    break;
            }
        }
        for (const std::string& expected : case_.expected) {
            const std::string failure = hear(expected);
            if (!failure.empty()) return failure;
        }
        return over_ ? "" : check_alive();
    }

private:
    std::string join() {
        peer_.send(handshake(port_, case_.subprotocol));
        if (!peer_.read_head(deadline()).starts_with("HTTP/1.1 101 ")) return "the handshake failed";
        if (next() != "hello") return "no Hello came";
        return case_.stage == Stage::joined ? identify() : "";
    }
    std::string identify() {
        v1::ClientMessage message;
        message.mutable_identify()->set_client("conformance");
        say(message);
        return next() == "ready" ? "" : "no Ready came";
    }
    void say(const v1::ClientMessage& message) {
        const bool json = case_.subprotocol == kSubprotocolJson;
        const std::string bytes = encode_message(json ? Encoding::json : Encoding::proto, message);
        peer_.send(frame(json ? kText : kBinary, json ? bytes : "\x01" + bytes));
    }
    Clock::time_point deadline() const { return Clock::now() + kPatience; }

    // Result: the next thing that means something; "end" at the end, "silence" where nothing comes.
    std::string next() {
        for (const auto until = deadline();;) {
            const HeardFrame heard = peer_.read_frame(until);
            if (heard.opcode < 0) return peer_.ended() ? "end" : "silence";
            const std::string means = meaning(heard, case_.subprotocol);
            if (!means.empty()) return means;
        }
    }

    std::string hear(const std::string& expected) {
        if (case_.stage == Stage::connected && head_.empty() && expected[0] != 'e') return hear_head(expected);
        if (expected[0] == '+' || expected[0] == '-') return check_header(expected);
        if (expected == "end") {
            over_ = true;
            return peer_.read_end(deadline()) ? "" : "the connection was not closed";
        }
        const auto wanted = alternatives(expected);
        const bool any_pong = expected.starts_with("pongs ");
        for (;;) {
            const std::string heard = next();
            for (const std::string& one : wanted) {
                const bool found = any_pong ? heard == "pong " + one.substr(6) : heard == one;
                if (!found) continue;
                over_ = over_ || heard == "end" || heard.starts_with("close ");
                return "";
            }
            if (heard == "ping" || (any_pong && heard.starts_with("pong "))) continue;
            return "expected " + shortened(expected) + ", heard " + shortened(heard);
        }
    }

    std::string hear_head(const std::string& expected) {
        const auto wanted = alternatives(expected);
        head_ = peer_.read_head(deadline());
        if (head_.empty()) {
            over_ = true;
            for (const std::string& one : wanted)
                if (one == "end" && peer_.ended()) return "";
            return "no answer to the handshake";
        }
        const std::string status = head_.substr(9, 3);
        over_ = status != "101";
        for (const std::string& one : wanted)
            if (status == one || (one == "4xx" && status[0] == '4')) return "";
        return "expected " + expected + ", heard status " + status;
    }
    std::string check_header(const std::string& expected) {
        const bool has = head_.find("\r\n" + expected.substr(1)) != std::string::npos;
        return has == (expected[0] == '+') ? "" : "the answer's headers are wrong: " + expected + " in\n" + head_;
    }

    std::string check_alive() {
        if (case_.stage == Stage::connected && next() != "hello") return "no Hello came";
        const bool ready = !case_.expected.empty() && case_.expected.back() == "ready";
        if (case_.stage != Stage::joined && !ready) {
            const std::string failure = identify();
            if (!failure.empty()) return failure;
        }
        v1::ClientMessage message;
        message.set_request_id(8);
        message.mutable_profile()->set_light(kAlive);
        say(message);
        for (;;) {
            const std::string heard = next();
            if (heard == "ping") continue;
            if (heard != "echo " + std::string(kAlive)) return "it does not answer any more, but: " + shortened(heard);
            return "";
        }
    }

    const Case& case_;
    std::uint16_t port_;
    RawPeer peer_;
    std::string head_;
    bool over_ = false;
};

// The cases and what went wrong in each, once for all tests.
struct AllCases {
    PlayedDaemon daemon{[] {
        HttpLimits limits;
        limits.clients = 1000;
        limits.connections = 1000;
        limits.header = 2500ms;
        limits.identify = 2500ms;  // a slow machine must manage to identify
        limits.ping = 1500ms;
        limits.dead = 3000ms;
        return limits;
    }()};
    std::vector<Case> cases = all_cases(daemon.port());
    std::vector<std::string> failures = std::vector<std::string>(cases.size(), "not run");
    bool all_gone = false;

    AllCases() {
        std::atomic<std::size_t> next{0};
        std::vector<std::thread> threads;
        for (int i = 0; i < 24; ++i)
            threads.emplace_back([&] {
                for (std::size_t at; (at = next++) < cases.size();)
                    failures[at] = Conversation(cases[at], daemon.port()).run();
            });
        for (std::thread& thread : threads) thread.join();
        all_gone = daemon.wait_until_alone(5s);
    }
    static AllCases& get() {
        static AllCases run;
        return run;
    }
};

class Rfc6455 : public testing::TestWithParam<std::size_t> {};

TEST_P(Rfc6455, Case) {
    const AllCases& run = AllCases::get();
    const Case& one = run.cases[GetParam()];
    EXPECT_EQ(run.failures[GetParam()], "") << one.name << ", " << one.clause;
}

INSTANTIATE_TEST_SUITE_P(All, Rfc6455, testing::Range<std::size_t>(0, all_cases(1).size()), [](const auto& which) {
    static const std::vector<Case> cases = all_cases(1);
    return cases[which.param].name;
});

TEST(Rfc6455Table, IsWholeAndLeavesNobodyBehind) {
    const AllCases& run = AllCases::get();
    std::set<std::string> names;
    for (const Case& one : run.cases) {
        EXPECT_TRUE(names.insert(one.name).second) << one.name << " is there twice";
        EXPECT_FALSE(one.clause.empty()) << one.name;
    }
    EXPECT_GE(names.size(), 150u);
    EXPECT_TRUE(run.all_gone) << "a client that has left is still known";
}

}  // namespace
}  // namespace gonio::conformance
