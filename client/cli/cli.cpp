#include "client/cli/cli.h"

#include <algorithm>
#include <array>
#include <cstdlib>

#include "client/cli/commands.h"

namespace gonio {
namespace {

constexpr const char* kVersion = "gonio " GONIO_VERSION ", protocol gonio.v1\n";

// Puts into the session where the server is and how to get in.
Result<bool> find_server(Session& session, const ReadWords& words) {
    const auto option = [&](const char* name, const std::string& otherwise) {
        return words.has(name) ? words.options.at(name) : otherwise;
    };
    const char* environment = std::getenv("GONIO_SERVER");
    const std::string usual = environment && *environment ? environment : "http://127.0.0.1:8080";
    const auto address = parse_server_url(option("--server", usual));
    if (!address) return address.error();
    session.address = *address;
    session.address.ca_file = option("--ca", "");
    session.role = option("--role", "");
    if (const std::string file = option("--token-file", ""); !file.empty()) {
        const auto token = read_token(file);
        if (!token) return token.error();
        session.token = *token;
        session.token_file = file;
    }
    return true;
}

}  // namespace

int run_cli(std::span<const std::string> args, std::ostream& out, std::ostream& err) {
    if (args.size() == 1 && args[0] == "--dump-options") {
        out << dump_words() << "\n";
        return kExitOk;
    }
    const ReadWords words = read_command_line(args);
    if (args.empty() || words.has("--help")) {
        (args.empty() ? err : out) << help_text(words);
        return args.empty() ? kExitUsage : kExitOk;
    }
    if (words.has("--version")) {
        out << kVersion;
        return kExitOk;
    }
    Session session{{}, {}, {}, {}, words.has("--json"), out, err};
    if (words.fault) return session.fail(*words.fault);
    constexpr std::array kOffline = {"photometry", "convert", "bake", "doctor"};  // work without a server
    if (std::ranges::find(kOffline, words.command->name) == kOffline.end())
        if (const auto found = find_server(session, words); !found) return session.fail(found.error());
    return run_command(session, words);
}

}  // namespace gonio
