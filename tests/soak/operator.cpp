#include "tests/soak/operator.h"

#include <stdexcept>

#include "protocol/schema/codec.h"
#include "protocol/schema/command.pb.h"
#include "protocol/schema/gonio.pb.h"

namespace gonio::soak {

using conformance::Clock;

namespace {
constexpr std::size_t kMostWaiting = 16;  // answers; servers bound them

std::string shortened(const google::protobuf::Message& message) {
    return message.ShortDebugString().substr(0, 120);
}
}  // namespace

Operator::Operator(std::uint16_t port) : peer_(std::make_unique<conformance::RawPeer>(port)) {
    const auto until = Clock::now() + std::chrono::seconds(10);
    peer_->send(conformance::handshake(port, kSubprotocolProto));
    if (!peer_->read_head(until).starts_with("HTTP/1.1 101 ")) throw std::runtime_error("the upgrade was refused");
    v1::ClientMessage identify;
    identify.mutable_identify()->set_client("soak operator");
    say(identify);
    for (int message = 0; message < 2; ++message)  // Hello, Ready
        if (peer_->read_frame(until).opcode != conformance::kBinary) throw std::runtime_error("no Hello and Ready");
}

void Operator::say(const v1::ClientMessage& message) {
    peer_->send(conformance::frame(conformance::kBinary, "\x01" + message.SerializeAsString()));
}

void Operator::request(v1::ClientMessage message, int kind) {
    message.set_request_id(next_id_++);
    waiting_[message.request_id()] = {shortened(message), kind};
    say(message);
}

void Operator::send(const v1::Command& command) {
    for (const auto until = Clock::now() + std::chrono::seconds(10); waiting_.size() >= kMostWaiting;) {
        if (Clock::now() > until) throw std::runtime_error("the server does not answer");
        const auto heard = peer_->read_frame(Clock::now() + std::chrono::milliseconds(20));
        if (heard.opcode == conformance::kBinary) take(heard.payload);
    }
    v1::ClientMessage message;
    message.set_request_id(next_id_++);
    *message.mutable_command() = command;
    waiting_[message.request_id()] = {shortened(command)};
    say(message);
}

void Operator::Asked::hear() {
    const auto now = Clock::now();
    silent_ms = std::max(silent_ms, std::chrono::duration<double, std::milli>(now - heard).count());
    heard = now;
}

std::chrono::milliseconds Operator::longest_silence() const {
    auto first = Clock::now();
    for (const auto& [id, asked] : waiting_) first = std::min(first, asked.heard);
    return std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - first);
}

void Operator::take(const std::string& payload) {
    auto message = decode_server_message(Encoding::proto, std::string_view(payload).substr(payload.empty() ? 0 : 1));
    if (!message) throw std::runtime_error("the server sent something that cannot be decoded");
    if (message->has_progress())
        if (const auto asked = waiting_.find(message->progress().request()); asked != waiting_.end())
            asked->second.hear();
    if (message->request_id() == 0) return;
    ++answered_;
    if (message->request_id() == reply_to_) reply_ = *message;
    const auto asked = waiting_.find(message->request_id());
    if (asked == waiting_.end()) return;
    const bool refused = message->has_result() && message->result().code() != "ok";
    const std::string why =
        refused ? message->result().code() + ": " + message->result().message() + " (" + asked->second.text + ")" : "";
    asked->second.hear();
    if (asked->second.kind >= 0)
        answers_.push_back(
            {asked->second.kind, asked->second.silent_ms, refused ? message->result().code() : "ok", why});
    else if (refused)
        refusals_.push_back(why);
    if (message->has_result()) newest_rev_ = std::max(newest_rev_, message->result().scene_rev());
    waiting_.erase(asked);
}

void Operator::listen() {
    for (;;) {
        const auto heard = peer_->read_frame(Clock::now());
        if (heard.opcode < 0) return;
        if (heard.opcode == conformance::kPing) peer_->send(conformance::frame(conformance::kPong, heard.payload));
        if (heard.opcode == conformance::kBinary) take(heard.payload);
    }
}

bool Operator::settle(std::chrono::milliseconds time) {
    for (const auto until = Clock::now() + time; !waiting_.empty() && connected();) {
        if (Clock::now() > until) return false;
        const auto heard = peer_->read_frame(Clock::now() + std::chrono::milliseconds(20));
        if (heard.opcode == conformance::kBinary) take(heard.payload);
        if (heard.opcode == conformance::kPing) peer_->send(conformance::frame(conformance::kPong, heard.payload));
    }
    return waiting_.empty();
}

std::optional<v1::ServerMessage> Operator::ask(v1::ClientMessage message, std::chrono::milliseconds time) {
    reply_.reset();
    reply_to_ = next_id_++;
    message.set_request_id(reply_to_);
    waiting_[reply_to_] = {shortened(message)};
    say(message);
    for (const auto until = Clock::now() + time; !reply_ && connected() && Clock::now() < until;) {
        const auto heard = peer_->read_frame(Clock::now() + std::chrono::milliseconds(20));
        if (heard.opcode == conformance::kBinary) take(heard.payload);
    }
    return std::exchange(reply_, std::nullopt);
}

}  // namespace gonio::soak
