// `gonio relay`: a viewer whose pictures go on, as they are, to one receiver that has viewers of its own.
#include <poll.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <optional>
#include <utility>

#include "client/cli/cli.h"
#include "client/cli/commands.h"
#include "client/cli/output.h"
#include "client/relay/key_frames.h"
#include "client/relay/media_time.h"
#include "client/relay/nal_units.h"
#include "client/relay/rtp_output.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/session.pb.h"
#include "protocol/schema/words.h"

namespace gonio {
namespace {

constexpr std::uint64_t kMs = 1'000'000, kSecond = 1'000'000'000;
constexpr std::uint64_t kFirstPause = kSecond / 2, kLongestPause = 8 * kSecond;  // between attempts to connect
constexpr std::uint64_t kRefusedPause = 15 * kSecond;  // else it uses up the wrong tokens that its address may show
constexpr std::uint64_t kPatience = 10 * kSecond;      // with a server that shows nothing, or makes no key frame
constexpr std::uint64_t kNoteEvery = 10 * kSecond;     // of packets that were not sent
constexpr std::size_t kMaxPictureBytes = 16u << 20;
constexpr int kEventsATurn = 64, kTurnMs = 50;

volatile std::sig_atomic_t interrupted = 0;

std::uint64_t now_ns() {
    const auto since = std::chrono::steady_clock::now().time_since_epoch();
    return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(since).count());
}

// SIGINT and SIGTERM end the loop, so that receivers are told, a second one the program; SIGPIPE is an error of
// writing.
void take_signals() {
    struct sigaction action {};
    action.sa_handler = [](int) { interrupted = 1; };
    action.sa_flags = static_cast<int>(SA_RESETHAND);
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
    std::signal(SIGPIPE, SIG_IGN);
}

struct Wanted {
    std::string rtp, sdp_file;
    std::uint16_t rtcp_port = 0;
    std::uint64_t key_every_ns = 2 * kSecond;
    std::uint32_t pictures = 0;  // 0: no end
};

Result<Wanted> read_wanted(const ReadWords& words) {
    Wanted wanted;
    const auto refusal = [&](const char* option, const char* what) {
        return Error{"usage", option, words.has(option) ? words.options.at(option) : "", what};
    };
    const bool rtp = words.has("--rtp");
    if (rtp == words.has("--annexb")) return refusal("--rtp", "One of --rtp and --annexb must be there.");
    for (const char* option : {"--rtcp", "--sdp"})
        if (!rtp && words.has(option)) return refusal(option, "This goes with --rtp.");
    if (rtp) wanted.rtp = words.options.at("--rtp");
    if (words.has("--sdp")) wanted.sdp_file = words.options.at("--sdp");
    if (words.has("--rtcp")) {
        const std::uint32_t port = *parse_count(words.options.at("--rtcp"));
        if (port < 1 || port > 65535) return refusal("--rtcp", "This must be 1 to 65535.");
        wanted.rtcp_port = static_cast<std::uint16_t>(port);
    }
    if (words.has("--key-every")) {
        const double seconds = *parse_number(words.options.at("--key-every"));
        if (!(seconds >= 0.5 && seconds <= 60)) return refusal("--key-every", "This must be 0.5 to 60 seconds.");
        wanted.key_every_ns = static_cast<std::uint64_t>(seconds * 1e9);
    }
    const auto frames = frames_wanted(words);
    if (!frames) return frames.error();
    wanted.pictures = *frames;
    return wanted;
}

class Relay {
public:
    Relay(const Session& session, const Wanted& wanted, std::optional<RtpOutput> rtp)
        : session_(session), wanted_(wanted), token_(session.token), rtp_(std::move(rtp)), keys_(wanted.key_every_ns) {}

    // Result: whether there is a connection. Errors: of Connection::open. The token is read again: it may be another.
    Result<bool> connect() {
        if (!session_.token_file.empty())
            if (const auto token = read_token(session_.token_file)) token_ = *token;
        auto opened = Connection::open(session_.address, {token_, true, false, "viewer"});
        if (!opened) return opened.error();
        connection_ = std::move(*opened);
        end_when_silent(connection_->descriptor());
        connected_ns_ = now_ns();
        unanswered_ns_ = 0;
        begun_ = told_of_nothing_ = false;
        return true;
    }

    // Errors: "file_unwritable".
    Result<bool> run() {
        while (!interrupted && !done()) {
            if (!connection_ && now_ns() >= retry_ns_) reconnect();
            const auto taken = take_pictures();
            if (!taken) return taken.error();
            if (rtp_ && rtp_->key_frame_wanted()) keys_.wanted();
            if (auto kept = keep_key_frames(); !kept) return kept;
            if (rtp_ && counts_.pictures > 0) rtp_->report(time_.at(now_ns()), now_ns());
            tell_of_faults();
            wait(*taken ? 0 : kTurnMs);
        }
        if (rtp_ && counts_.pictures > 0) rtp_->leave(time_.at(now_ns()));
        return true;
    }

    void tell_counts() const {
        const RtpOutput::Counts sent = rtp_ ? rtp_->counts() : RtpOutput::Counts{};
        const std::pair<const char*, std::uint64_t> counts[] = {
            {"pictures", counts_.pictures}, {"bytes", counts_.bytes},        {"key_frames", counts_.key_frames},
            {"repeated", counts_.repeated}, {"asked_server", counts_.asked}, {"asked_by_receivers", sent.asked},
            {"packets_sent", sent.packets}, {"packets_unsent", sent.unsent}, {"connections_lost", counts_.lost}};
        std::string text;
        for (const auto& [name, count] : counts)
            text += session_.json
                        ? (text.empty() ? "{\"relay\":{\"" : ",\"") + std::string(name) + "\":" + std::to_string(count)
                        : (text.empty() ? "gonio: " : ", ") + std::string(name) + " " + std::to_string(count);
        session_.err << text << (session_.json ? "}}" : "") << std::endl;
    }

private:
    bool done() const { return wanted_.pictures > 0 && counts_.pictures >= wanted_.pictures; }
    void note(const std::string& text) const { session_.err << "gonio: " << text << std::endl; }

    void lose(const std::string& why, std::uint64_t pause_ns) {
        connection_.reset();
        ++counts_.lost;
        pause_ns_ = std::max(kFirstPause, std::min(pause_ns, kLongestPause));
        retry_ns_ = now_ns() + pause_ns_;
        note("the connection broke: " + why + " Trying again.");
    }

    void reconnect() {
        const auto again = connect();
        if (again) {
            note("connected again");
            pause_ns_ = kFirstPause;
            told_refusal_.clear();
            return;
        }
        const bool refused = again.error().code == "refused";
        if (refused && told_refusal_ != again.error().where) {
            told_refusal_ = again.error().where;
            note("refused " + again.error().where + ": " + again.error().message + " Trying again every 15 s.");
        }
        pause_ns_ = std::min(2 * pause_ns_, kLongestPause);
        retry_ns_ = now_ns() + (refused ? kRefusedPause : pause_ns_);
    }

    // Result: whether more may have arrived.
    Result<bool> take_pictures() {
        for (int i = 0; i < kEventsATurn; ++i) {
            if (!connection_ || done()) return false;
            auto event = connection_->next_arrived();
            if (!event) {
                lose(event.error().message, 0);
                return false;
            }
            if (!*event) return false;
            if ((*event)->message.has_goodbye()) {
                const v1::Goodbye& goodbye = (*event)->message.goodbye();
                lose("the server said: " + goodbye.reason() + ".", goodbye.reconnect_after_ms() * kMs);
                return false;
            }
            if ((*event)->access_unit.empty()) continue;
            if (auto sent = pass_on(**event); !sent) return sent;
        }
        return true;
    }

    Result<bool> pass_on(ServerEvent& event) {
        const std::uint64_t now = now_ns();
        if (event.access_unit.size() > kMaxPictureBytes) {
            lose("a picture has more than 16 MiB.", 0);
            return false;
        }
        const std::vector<ByteSpan> units = with_parameter_sets(nal_units(event.access_unit), sets_);
        const bool key = is_idr(units);
        if (key) {
            begun_ = true;
            if (auto described = describe(); !described) return described;
        }
        if (begun_) {
            if (auto sent = send(units, time_.picture(event.header.rendered_ns, now), key); !sent) return sent;
            if (key) last_key_ = std::move(event.access_unit);
        }
        v1::ClientMessage ack;  // after it went out: a pipe that nobody empties stops the server's work for this viewer
        ack.mutable_frame_ack()->set_seq(event.header.seq);
        if (const auto said = connection_->say(ack); !said) lose(said.error().message, 0);
        return true;
    }

    Result<bool> send(const std::vector<ByteSpan>& units, std::uint64_t media_ns, bool key) {
        keys_.sent(key, now_ns());
        if (key) unanswered_ns_ = 0;
        ++counts_.pictures;
        counts_.key_frames += key ? 1 : 0;
        for (const ByteSpan unit : units) counts_.bytes += unit.size();
        if (rtp_) {
            rtp_->picture(units, media_ns);
            return true;
        }
        const std::vector<std::byte> bytes = annex_b(units);
        session_.out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
        session_.out.flush();
        if (!session_.out && !interrupted)  // by which a full pipe is left too
            return Error{"file_unwritable", "--annexb", "", "Nobody reads the standard output any more."};
        return true;
    }

    Result<bool> keep_key_frames() {
        const std::uint64_t now = now_ns();
        switch (keys_.due(now, connection_ != nullptr)) {
            case KeyFrames::Due::nothing:
                return true;
            case KeyFrames::Due::repeat:
                ++counts_.repeated;
                return send(with_parameter_sets(nal_units(last_key_), sets_), time_.again(now), true);
            case KeyFrames::Due::ask:
                break;
        }
        if (unanswered_ns_ == 0) unanswered_ns_ = now;
        if (now - unanswered_ns_ > kPatience) {
            lose("the server makes no key frame.", 0);
            return true;
        }
        ++counts_.asked;
        keys_.asked(now);
        v1::ClientMessage request;
        request.mutable_request_keyframe();
        if (const auto said = connection_->say(request); !said) lose(said.error().message, 0);
        return true;
    }

    // Writes the SDP, also after a change of what it says.
    Result<bool> describe() {
        if (!rtp_ || (described_ && *described_ == sets_)) return true;
        const std::string text = rtp_->description(sets_);
        if (wanted_.sdp_file.empty()) {
            session_.out << text << std::flush;
        } else {
            if (auto written = write_atomically(wanted_.sdp_file, text); !written) {
                Error error = written.error();
                error.where = "--sdp";
                return error;
            }
        }
        if (!described_)
            note("sending to " + wanted_.rtp + "; RTCP is heard at port " +
                 std::to_string(rtp_->sockets().rtcp_port()));
        described_ = sets_;
        return true;
    }

    void tell_of_faults() {
        const std::uint64_t now = now_ns();
        if (connection_ && !begun_ && !told_of_nothing_ && now - connected_ns_ > kPatience) {
            told_of_nothing_ = true;
            note("the server shows no picture in H.264; gonio stats says which encoder it has");
        }
        if (!rtp_ || rtp_->counts().unsent == told_unsent_ || now - told_unsent_ns_ < kNoteEvery) return;
        note(std::to_string(rtp_->counts().unsent - told_unsent_) + " packets could not be sent");
        told_unsent_ = rtp_->counts().unsent;
        told_unsent_ns_ = now;
    }

    void wait(int ms) const {
        std::array<pollfd, 3> waited{};
        nfds_t count = 0;
        if (connection_) waited[count++] = {connection_->descriptor(), POLLIN, 0};
        if (rtp_) waited[count++] = {rtp_->sockets().rtp_descriptor(), POLLIN, 0};
        if (rtp_) waited[count++] = {rtp_->sockets().rtcp_descriptor(), POLLIN, 0};
        ::poll(waited.data(), count, ms);  // a signal ends it too
    }

    struct Counts {
        std::uint64_t pictures = 0, bytes = 0, key_frames = 0, repeated = 0, asked = 0, lost = 0;
    };

    const Session& session_;
    const Wanted& wanted_;
    std::string token_;
    std::optional<RtpOutput> rtp_;
    std::unique_ptr<Connection> connection_;
    KeyFrames keys_;
    MediaTime time_;
    ParameterSets sets_;
    std::optional<ParameterSets> described_;
    std::vector<std::byte> last_key_;  // the access unit
    Counts counts_;
    bool begun_ = false;  // this connection had a key frame
    bool told_of_nothing_ = false;
    std::string told_refusal_;         // its place
    std::uint64_t unanswered_ns_ = 0;  // since when a key frame is asked for; 0: it is not
    std::uint64_t connected_ns_ = 0, retry_ns_ = 0, pause_ns_ = kFirstPause, told_unsent_ = 0, told_unsent_ns_ = 0;
};

}  // namespace

int relay(const Session& session, const ReadWords& words) {
    const auto wanted = read_wanted(words);
    if (!wanted) return session.fail(wanted.error());
    std::optional<RtpOutput> rtp;
    if (!wanted->rtp.empty()) {
        auto sockets = RtpSockets::open(wanted->rtp, wanted->rtcp_port);
        if (!sockets) return session.fail(sockets.error());
        rtp.emplace(std::move(*sockets));
    }
    take_signals();
    Relay relay(session, *wanted, std::move(rtp));
    if (const auto connected = relay.connect(); !connected) return session.fail(connected.error());
    const auto ran = relay.run();
    relay.tell_counts();
    return ran ? kExitOk : session.fail(ran.error());
}

}  // namespace gonio
