#include "client/cli/session.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iostream>

#include "client/cli/cli.h"
#include "client/cli/output.h"
#include "protocol/schema/codec.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/measure.pb.h"
#include "protocol/schema/session.pb.h"

namespace gonio {

Result<std::string> read_token(const std::string& file_name) {
    std::ifstream file(file_name);
    std::string token;
    std::getline(file, token);
    if (!file.is_open() || file.bad())
        return Error{"file_unreadable", "--token-file", file_name, "The token cannot be read."};
    while (!token.empty() && (token.back() == '\r' || token.back() == ' ')) token.pop_back();
    return token;
}

void Session::print(const google::protobuf::Message& message) const {
    out << to_json(message, json) << "\n";
}

void Session::warn(const google::protobuf::RepeatedPtrField<std::string>& warnings) const {
    for (const std::string& warning : warnings) err << "warning: " << warning << "\n";
}

int Session::fail(const Error& error) const {
    if (json) print(refusal(error));
    err << "gonio: " << error.code;
    if (!error.where.empty()) err << " " << error.where;
    if (!error.value.empty()) err << " " << error.value;
    err << ": " << error.message << "\n";
    if (error.code == "usage") err << "gonio --help lists the commands, gonio COMMAND --help their options\n";
    if (error.code == "usage" || error.code == "file_unreadable" || error.code == "file_unwritable") return kExitUsage;
    return error.code == "unreachable" || error.code == "untrusted" ? kExitUnreachable : kExitRefused;
}

Result<v1::ServerMessage> Session::ask(v1::ClientMessage message,
                                       std::initializer_list<v1::ServerMessage::MessageCase> wanted,
                                       const std::string& invitation) const {
    auto connection = Connection::open(address, {token, false, false, role});
    if (!connection) return connection.error();
    const v1::Ready& ready = (*connection)->ready();
    const bool takes_changes = ready.role() != "viewer" && !ready.state().has_leader();
    if (!invitation.empty() && !json && takes_changes) err << invitation << std::endl;
    const bool terminal = &err == &std::cerr && ::isatty(STDERR_FILENO) == 1;
    std::size_t shown = 0;  // characters of the progress line
    auto answer = (*connection)->ask(std::move(message), [&](const v1::Progress& progress) {
        if (!terminal) return;
        const std::string line = progress_line(progress);
        err << "\r" << line << std::string(shown > line.size() ? shown - line.size() : 0, ' ') << std::flush;
        shown = line.size();
    });
    if (shown > 0) err << "\r" << std::string(shown, ' ') << "\r" << std::flush;
    if (!answer) return answer;
    if (std::find(wanted.begin(), wanted.end(), answer->message_case()) == wanted.end())
        return Error{"bad_message", "", "", "The server's answer is not one to this question."};
    return answer;
}

int Session::change(v1::ClientMessage message) const {
    return changed(ask(std::move(message), {v1::ServerMessage::kResult}));
}

int Session::changed(const Result<v1::ServerMessage>& answer) const {
    if (!answer) return fail(answer.error());
    if (json) {
        print(answer->result());
        return kExitOk;
    }
    // Red where a person reads it: something is not as it was asked for.
    const bool colours = &err == &std::cerr && ::isatty(STDERR_FILENO) == 1 && std::getenv("NO_COLOR") == nullptr;
    for (const std::string& warning : answer->result().warnings())
        err << (colours ? "\033[31m" : "") << "warning: " << warning << (colours ? "\033[0m" : "") << "\n";
    out << "scene_rev " << answer->result().scene_rev() << "\n";
    if (answer->result().has_replaced())
        out << "replaced " << answer->result().replaced() << " (gonio undo brings it back)\n";
    for (const std::string& note : answer->result().notes()) out << note << "\n";
    return kExitOk;
}

}  // namespace gonio
