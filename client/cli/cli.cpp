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

// gonio help [COMMAND…]: what COMMAND --help prints. Result: the exit code.
int help(const Session& session, const std::vector<std::string>& command) {
    const ReadWords words = read_command_line(command);
    // A command whose words are missing is what help is for.
    if (!command.empty() && !words.command && (words.group.empty() || words.group != command.back()))
        return session.fail(*words.fault);
    session.out << help_text(words);
    return kExitOk;
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
    const auto is = [&](const char* name) { return words.command != nullptr && words.command->name == name; };
    if (words.has("--version") || is("version")) {
        out << kVersion;
        return kExitOk;
    }
    Session session{{}, {}, {}, {}, words.has("--json"), out, err};
    if (words.fault) return session.fail(*words.fault);
    if (is("help")) return help(session, words.names);
    constexpr std::array kOffline = {"photometry", "convert", "bake", "doctor"};  // work without a server
    if (std::ranges::find(kOffline, words.command->name) == kOffline.end())
        if (const auto found = find_server(session, words); !found) return session.fail(found.error());
    return run_command(session, words);
}

}  // namespace gonio
