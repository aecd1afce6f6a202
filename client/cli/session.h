// What one call of gonio works with: the server that it asks, and where its answers and refusals go.
#pragma once

#include <initializer_list>
#include <ostream>
#include <string>

#include "client/connection/connection.h"

namespace gonio {

// Result: the first line of a file, without blanks at its end. Errors: "file_unreadable".
Result<std::string> read_token(const std::string& file_name);

struct Session {
    ServerAddress address;
    std::string token, token_file;  // the file's; empty: none
    std::string role;
    bool json = false;
    std::ostream& out;
    std::ostream& err;

    // JSON: indented for people, one line with --json.
    void print(const google::protobuf::Message& message) const;
    // Writes the warnings of an answer to `err`, a line each.
    void warn(const google::protobuf::RepeatedPtrField<std::string>& warnings) const;
    // Result: the exit code; the error goes to stderr, with --json also to `out`, as the Result that a server sends.
    int fail(const Error& error) const;
    // invitation: printed to whoever shall do something now, where this server takes it. Result: the answer, which is
    // one of `wanted`. Errors: of Connection::ask; "bad_message".
    Result<v1::ServerMessage> ask(v1::ClientMessage message,
                                  std::initializer_list<v1::ServerMessage::MessageCase> wanted,
                                  const std::string& invitation = "") const;
    // Sends a command and prints the revision that contains it. Result: the exit code.
    int change(v1::ClientMessage message) const;
    // Prints what answered a command, or why it was refused. Result: the exit code.
    int changed(const Result<v1::ServerMessage>& answer) const;
};

}  // namespace gonio
