// One client of the soak that controls: sends commands without waiting and keeps account of the answers.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/messages.h"
#include "tests/conformance/raw_peer.h"

namespace gonio::soak {

// What came of a request, for whoever wants to know each one.
struct Answer {
    int kind = 0;                   // as the request was given
    double silent_ms = 0;           // the longest time without a word: neither progress nor the answer
    std::string code = "ok", text;  // of a refusal: what the server says, and what was asked
};

class Operator {
public:
    // Connects to a goniod on 127.0.0.1. Throws std::runtime_error where it does not become Ready.
    explicit Operator(std::uint16_t port);

    // Does not wait for the answer, unless many are waited for already. Throws where none comes for 10 s.
    void send(const v1::Command& command);
    // The same of any request. kind: 0 or more, of its Answer.
    void request(v1::ClientMessage message, int kind);
    bool ready() const { return waiting_.size() < kMostAsked; }
    // Result: since the last call.
    std::vector<Answer> take_answers() { return std::exchange(answers_, {}); }
    // Reads what has come.
    void listen();
    // Waits for all answers. Result: false where one is missing after that time.
    bool settle(std::chrono::milliseconds time);
    // Result: for how long the server has said nothing of a request that waits, neither progress nor an answer.
    std::chrono::milliseconds longest_silence() const;
    // Result: what is not answered yet, the first of it; empty: all is.
    std::string waits_for() const { return waiting_.empty() ? "" : waiting_.begin()->second.text; }
    // Asks and waits for the answer to this.
    std::optional<v1::ServerMessage> ask(v1::ClientMessage message, std::chrono::milliseconds time);

    std::uint32_t newest_rev() const { return newest_rev_; }  // that an answer has named
    std::uint64_t answered() const { return answered_; }
    const std::vector<std::string>& refusals() const { return refusals_; }
    bool connected() const { return !peer_->ended(); }

private:
    static constexpr std::size_t kMostAsked = 8;
    struct Asked {
        std::string text;
        int kind = -1;                                                     // a command of send()
        conformance::Clock::time_point heard = conformance::Clock::now();  // asked, or told of progress
        double silent_ms = 0;                                              // the longest time up to then
        void hear();
    };
    void say(const v1::ClientMessage& message);
    void take(const std::string& payload);

    std::unique_ptr<conformance::RawPeer> peer_;
    std::uint32_t next_id_ = 1, newest_rev_ = 0;
    std::uint64_t answered_ = 0;
    std::map<std::uint32_t, Asked> waiting_;  // by request_id
    std::vector<Answer> answers_;
    std::vector<std::string> refusals_;
    std::optional<v1::ServerMessage> reply_;
    std::uint32_t reply_to_ = 0;
};

}  // namespace gonio::soak
