// The options of goniod that concern its network: addresses, TLS, files of clients, and every limit.
#pragma once

#include "server/app/options.h"
#include "server/http/http_server.h"

namespace CLI {
class App;
}

namespace gonio {

void add_front_options(CLI::App& app, Options& options);

// What is wrong with options that depend on each other or on files.
struct OptionFault {
    std::vector<std::string> options;  // that it is about, without their dashes
    std::string text;                  // a sentence
};
// Result: an address that is not loopback without a token, a certificate without its key, a token that is too short.
// Reads the files.
std::vector<OptionFault> check_front_options(const Options& options);

bool is_loopback(const std::string& host);

// Result: the token of the file, its first line without blanks at the ends; empty where path is. Errors:
// "file_unreadable" (also a token under 16 bytes, or with a byte that HTTP does not carry; the message names the
// byte's place, never its value). Others than its owner may read it: *warning says so.
Result<std::string> token_of_file(const std::string& path, std::string* warning = nullptr,
                                  const char* option = "--token-file");
// Result: the tokens of both files. Errors: those of token_of_file; "invalid_argument" where a viewer's is alone or the
// same as the other. warnings: of both, in one line.
Result<Tokens> read_tokens(const Options& options, std::string* warnings = nullptr);

}  // namespace gonio
