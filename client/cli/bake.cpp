#include "client/cli/bake.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

namespace gonio {

std::vector<std::string> bake_arguments(const ReadWords& words) {
    std::vector<std::string> arguments{"--bake=" + words.names.at(0), "--out=" + words.names.at(1)};
    for (std::size_t i = 2; i < words.names.size(); ++i) arguments.push_back("--bake-set=" + words.names[i]);
    constexpr const char* kPassedOn = "scale";  // of goniod itself
    for (const WordRow& row : words.command->options) {
        if (!words.has(row.name)) continue;
        const std::string name(row.name.substr(2));
        arguments.push_back((name == kPassedOn ? "--" : "--bake-") + name + "=" + words.options.at(row.name));
    }
    return arguments;
}

int bake(const Session& session, const ReadWords& words) {
    std::error_code failed;
    const std::filesystem::path own = std::filesystem::read_symlink("/proc/self/exe", failed);
    const std::string daemon = (own.parent_path() / "goniod").string();
    const std::vector<std::string> arguments = bake_arguments(words);
    std::vector<char*> argv{const_cast<char*>(daemon.c_str())};
    for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);
    session.out.flush();
    session.err.flush();
    ::execv(daemon.c_str(), argv.data());
    return session.fail({"not_found", "goniod", daemon, std::string("it cannot be run: ") + std::strerror(errno)});
}

}  // namespace gonio
