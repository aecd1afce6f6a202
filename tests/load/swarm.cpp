#include "tests/load/swarm.h"

#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>

#include "protocol/schema/codec.h"
#include "protocol/schema/frame_header.h"
#include "protocol/schema/gonio.pb.h"
#include "tests/conformance/raw_peer.h"

namespace gonio::load {
namespace {

using conformance::frame;
using conformance::RawPeer;
using Clock = std::chrono::steady_clock;

constexpr auto kPatience = std::chrono::seconds(10);
constexpr int kTickMs = 20;  // of the slow readers

std::string say(const v1::ClientMessage& message) {
    return frame(conformance::kBinary, "\x01" + message.SerializeAsString());
}

std::int64_t now_ns(clockid_t clock) {
    timespec now{};
    clock_gettime(clock, &now);
    return now.tv_sec * std::int64_t{1'000'000'000} + now.tv_nsec;
}

}  // namespace

double percentile_ms(std::vector<std::uint32_t> values_us, double share) {
    if (values_us.empty()) return 0;
    const auto last = static_cast<double>(values_us.size() - 1);
    const auto at = values_us.begin() + static_cast<std::ptrdiff_t>(std::lround(share * last));
    std::nth_element(values_us.begin(), at, values_us.end());
    return *at * 1e-3;
}

Swarm::Swarm(std::uint16_t port) : port_(port), epoll_(epoll_create1(EPOLL_CLOEXEC)) {
    thread_ = std::thread([this] { run(); });
}

Swarm::~Swarm() {
    done_ = true;
    thread_.join();
    for (auto& [id, member] : members_)
        if (member->socket >= 0) ::close(member->socket);
    ::close(epoll_);
}

int Swarm::join(Kind kind, double bytes_per_s) {
    RawPeer peer(port_, kind == Kind::slow || kind == Kind::deaf ? 16 << 10 : 0);
    const auto until = Clock::now() + kPatience;
    if (!peer.connected() || !peer.send(conformance::handshake(port_, kSubprotocolProto)) ||
        !peer.read_head(until).starts_with("HTTP/1.1 101 "))
        return -1;
    v1::ClientMessage message;
    message.mutable_identify()->set_client("swarm");
    message.mutable_identify()->set_video(kind != Kind::idle);
    peer.send(say(message));
    auto member = std::make_unique<Member>();
    member->tally.kind = kind;
    member->bytes_per_s = bytes_per_s;
    for (const char* expected : {"hello", "ready"}) {
        const auto heard = peer.read_frame(until);
        const auto answer = decode_server_message(
            Encoding::proto, std::string_view(heard.payload).substr(heard.payload.empty() ? 0 : 1));
        if (!answer || !(expected[0] == 'h' ? answer->has_hello() : answer->has_ready())) return -1;
    }
    member->buffer = peer.take_heard();
    member->socket = peer.release();
    const std::lock_guard lock(mutex_);
    const int id = next_id_++;
    take_frames(*member);
    if (kind == Kind::viewer || kind == Kind::idle) {
        epoll_event event{EPOLLIN, {.fd = id}};
        epoll_ctl(epoll_, EPOLL_CTL_ADD, member->socket, &event);
    }
    members_[id] = std::move(member);
    return id;
}

void Swarm::leave(int id, bool reset) {
    const std::lock_guard lock(mutex_);
    const auto found = members_.find(id);
    if (found == members_.end()) return;
    Member& member = *found->second;
    if (member.socket >= 0 && reset) {
        const linger now{1, 0};
        ::setsockopt(member.socket, SOL_SOCKET, SO_LINGER, &now, sizeof now);
    } else if (member.socket >= 0) {
        const std::string bytes = frame(conformance::kClose, conformance::close_payload(1000));
        ::send(member.socket, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    }
    close(member);
    members_.erase(found);
}

Tally Swarm::tally(int id) const {
    const std::lock_guard lock(mutex_);
    const auto found = members_.find(id);
    return found == members_.end() ? Tally{} : found->second->tally;
}

std::vector<Tally> Swarm::tallies(Kind kind) const {
    const std::lock_guard lock(mutex_);
    std::vector<Tally> result;
    for (const auto& [id, member] : members_)
        if (member->tally.kind == kind) result.push_back(member->tally);
    return result;
}

void Swarm::reset_tallies() {
    const std::lock_guard lock(mutex_);
    for (auto& [id, member] : members_) {
        Tally& tally = member->tally;
        tally.frames = tally.keys = tally.bytes = tally.older = 0;
        tally.latency_us.clear();
    }
}

void Swarm::close(Member& member) {
    if (member.socket < 0) return;
    ::close(member.socket);  // epoll forgets it
    member.socket = -1;
    member.tally.gone = true;
    member.buffer = {};
}

void Swarm::run() {
    auto last_tick = Clock::now();
    std::array<epoll_event, 256> events;
    while (!done_) {
        const int count = epoll_wait(epoll_, events.data(), static_cast<int>(events.size()), kTickMs);
        {
            const std::lock_guard lock(mutex_);
            for (int i = 0; i < count; ++i) {
                const auto found = members_.find(events[static_cast<std::size_t>(i)].data.fd);
                if (found != members_.end()) read(*found->second, 256 << 10);
            }
            const auto now = Clock::now();
            if (now - last_tick >= std::chrono::milliseconds(kTickMs)) {
                const double passed_s = std::chrono::duration<double>(now - last_tick).count();
                last_tick = now;
                for (auto& [id, member] : members_) {
                    if (member->tally.kind != Kind::slow || member->socket < 0) continue;
                    member->allowance =
                        std::min(member->allowance + passed_s * member->bytes_per_s, member->bytes_per_s);
                    if (member->allowance >= 1) read(*member, static_cast<std::size_t>(member->allowance));
                }
            }
        }
        cpu_ns_ = now_ns(CLOCK_THREAD_CPUTIME_ID);
    }
}

void Swarm::read(Member& member, std::size_t most) {
    if (member.socket < 0) return;
    static thread_local std::array<char, 256 << 10> bytes;
    const ssize_t n = ::recv(member.socket, bytes.data(), std::min(most, bytes.size()), MSG_DONTWAIT);
    if (n == 0 || (n < 0 && errno != EAGAIN && errno != EINTR)) return close(member);
    if (n < 0) return;
    member.allowance -= static_cast<double>(n);
    member.tally.bytes += static_cast<std::uint64_t>(n);
    member.buffer.append(bytes.data(), static_cast<std::size_t>(n));
    take_frames(member);
}

void Swarm::take_frames(Member& member) {
    std::size_t at = 0;
    const std::string& buffer = member.buffer;
    const auto byte = [&](std::size_t i) { return static_cast<std::uint64_t>(static_cast<unsigned char>(buffer[i])); };
    while (buffer.size() - at >= 2) {
        std::uint64_t length = byte(at + 1) & 0x7f;
        const std::size_t extra = length == 126 ? 2 : length == 127 ? 8 : 0;
        if (buffer.size() - at < 2 + extra) break;
        if (extra > 0) length = 0;
        for (std::size_t i = 0; i < extra; ++i) length = length << 8 | byte(at + 2 + i);
        if (buffer.size() - at < 2 + extra + length) break;
        const int opcode = static_cast<int>(byte(at) & 0x0f);
        const std::string payload = buffer.substr(at + 2 + extra, length);
        at += 2 + extra + length;
        std::string answer;
        if (opcode == conformance::kBinary && !payload.empty() && payload[0] == kBinaryVideo) {
            take_video(member, payload);
        } else if (opcode == conformance::kPing) {
            answer = frame(conformance::kPong, payload);
        } else if (opcode == conformance::kClose) {
            if (payload.size() >= 2)
                member.tally.close_code =
                    static_cast<unsigned char>(payload[0]) << 8 | static_cast<unsigned char>(payload[1]);
            answer = frame(conformance::kClose, payload);
        }
        if (!answer.empty()) ::send(member.socket, answer.data(), answer.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    }
    member.buffer.erase(0, at);
}

void Swarm::take_video(Member& member, const std::string& payload) {
    const auto header = decode_frame_header(std::as_bytes(std::span(payload.data(), payload.size())));
    if (!header) return;
    Tally& tally = member.tally;
    ++tally.frames;
    if (header->key) ++tally.keys;
    if (header->scene_rev < tally.newest_rev) ++tally.older;
    tally.newest_rev = std::max(tally.newest_rev, header->scene_rev);
    tally.final = header->final;
    const std::int64_t late_ns = now_ns(CLOCK_MONOTONIC) - static_cast<std::int64_t>(header->rendered_ns);
    tally.latency_us.push_back(static_cast<std::uint32_t>(std::clamp<std::int64_t>(late_ns / 1000, 0, UINT32_MAX)));
    v1::ClientMessage message;
    message.mutable_frame_ack()->set_seq(header->seq);
    const std::string bytes = say(message);
    ::send(member.socket, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
}

}  // namespace gonio::load
