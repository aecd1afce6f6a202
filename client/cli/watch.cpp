#include <cstdio>
#include <fstream>

#include "client/cli/cli.h"
#include "client/cli/commands.h"
#include "client/cli/output.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/words.h"

namespace gonio {
namespace {

std::string frame_line(const ServerEvent& event) {
    char text[256];
    std::snprintf(text, sizeof text,
                  "{\"frame\":{\"seq\":%u,\"scene_rev\":%u,\"key\":%s,\"final\":%s,\"lane\":%u,\"bytes\":%zu,"
                  "\"rendered_s\":%.6f,\"render_us\":%u,\"encode_us\":%u}}",
                  event.header.seq, event.header.scene_rev, event.header.key ? "true" : "false",
                  event.header.final ? "true" : "false", event.header.lane, event.access_unit.size(),
                  static_cast<double>(event.header.rendered_ns) * 1e-9, event.header.render_us, event.header.encode_us);
    return text;
}

// Result: the line of a message; empty where it is none of a change.
std::string message_line(const v1::ServerMessage& message) {
    if (message.has_state_changed()) return "{\"state_changed\":" + to_json(message.state_changed(), true) + "}";
    if (message.has_video_config())  // another size, encoder or lane
        return "{\"video_config\":" + to_json(message.video_config(), true) + "}";
    if (message.has_ready()) return "{\"ready\":" + to_json(message.ready(), true) + "}";  // instead of many changes
    return {};
}

}  // namespace

Result<std::uint32_t> frames_wanted(const ReadWords& words) {
    if (!words.has("--frames")) return std::uint32_t{0};
    const std::string& text = words.options.at("--frames");
    const std::uint32_t frames = *parse_count(text);
    if (frames == 0) return Error{"usage", "--frames", text, "This must be 1 or more."};
    return frames;
}

int watch(const Session& session, const ReadWords& words) {
    const auto wanted = frames_wanted(words);
    if (!wanted) return session.fail(wanted.error());
    const std::uint32_t frames = *wanted;
    const std::string out_name = words.has("--out") ? words.options.at("--out") : "";
    const Error unwritable{"file_unwritable", "--out", out_name, "The file cannot be written."};
    std::ofstream file;
    if (!out_name.empty()) file.open(out_name, std::ios::binary);
    if (!file) return session.fail(unwritable);
    auto connection = Connection::open(session.address, {session.token, true, true, session.role});
    if (!connection) return session.fail(connection.error());
    for (std::uint32_t seen = 0; frames == 0 || seen < frames;) {
        const auto event = (*connection)->next();
        if (!event) return session.fail(event.error());
        if (event->message.has_goodbye())
            return session.fail({"unreachable", "", session.address.host_header(), event->message.goodbye().reason()});
        if (event->access_unit.empty()) {
            if (const std::string line = message_line(event->message); !line.empty()) session.out << line << std::endl;
            continue;
        }
        ++seen;
        session.out << frame_line(*event) << std::endl;
        file.write(reinterpret_cast<const char*>(event->access_unit.data()),
                   static_cast<std::streamsize>(event->access_unit.size()));
        file.flush();
        if (!out_name.empty() && !file) return session.fail(unwritable);
        v1::ClientMessage ack;
        ack.mutable_frame_ack()->set_seq(event->header.seq);
        if (const auto said = (*connection)->say(ack); !said) return session.fail(said.error());
    }
    return kExitOk;
}

}  // namespace gonio
