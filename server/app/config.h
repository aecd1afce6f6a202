// Options from a file and the environment, for whatever options a command line has: flag > environment > file >
// default. The name of an option, without its dashes, is its key in the file; GONIOD_ and the name in capitals, '-' as
// '_', its variable. CLI11 stays in the .cpp files.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace gonio {

struct Settings {
    std::vector<std::string> arguments;          // the command line, completed
    std::map<std::string, std::string> sources;  // option's name -> "show.toml line 3", "GONIOD_SIZE"
    std::vector<std::string> errors;             // of file and environment, a sentence each; empty: all is well
    std::vector<std::string> warnings;
};

inline constexpr std::size_t kMaxConfigBytes = 256 << 10;

// arguments: as main gets them, without the program's name; `app` has parsed them. environment: as ::environ.
// Options that are not configurable() are the command line's alone; "config" names the file.
Settings complete_settings(CLI::App& app, const std::vector<std::string>& arguments, char** environment);

// app: it has parsed settings.arguments. Result: TOML that gives the same options, each with a comment that says where
// it came from; those that stand at their default are comments as a whole.
std::string print_settings(const CLI::App& app, const Settings& settings);

}  // namespace gonio
