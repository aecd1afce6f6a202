#include "client/cli/bake.h"

#include "client/cli/beside.h"

namespace gonio {

std::vector<std::string> bake_arguments(const ReadWords& words) {
    std::vector<std::string> arguments{"--bake=" + words.names.at(0), "--out=" + words.names.at(1)};
    for (std::size_t i = 2; i < words.names.size(); ++i) arguments.push_back("--bake-set=" + words.names[i]);
    for (const WordRow& row : words.command->options) {
        if (!words.has(row.name)) continue;
        const std::string name(row.name.substr(2));
        const bool of_goniod = name == "scale" || name == "threads";
        arguments.push_back((of_goniod ? "--" : "--bake-") + name + "=" + words.options.at(row.name));
    }
    return arguments;
}

int bake(const Session& session, const ReadWords& words) {
    return become_goniod(session, bake_arguments(words));
}

}  // namespace gonio
