#include "client/cli/beside.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

namespace gonio {

int become_goniod(const Session& session, const std::vector<std::string>& arguments) {
    std::error_code failed;
    const std::filesystem::path own = std::filesystem::read_symlink("/proc/self/exe", failed);
    const std::string daemon = (own.parent_path() / "goniod").string();
    std::vector<char*> argv{const_cast<char*>(daemon.c_str())};
    for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);
    session.out.flush();
    session.err.flush();
    ::execv(daemon.c_str(), argv.data());
    return session.fail({"not_found", "goniod", daemon, std::string("it cannot be run: ") + std::strerror(errno)});
}

std::vector<std::string> doctor_arguments(const ReadWords& words, bool json) {
    std::vector<std::string> arguments{"--doctor"};
    if (json) arguments.emplace_back("--log=json");
    arguments.insert(arguments.end(), words.names.begin(), words.names.end());
    return arguments;
}

int doctor(const Session& session, const ReadWords& words) {
    return become_goniod(session, doctor_arguments(words, session.json));
}

}  // namespace gonio
