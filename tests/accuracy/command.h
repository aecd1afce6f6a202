// The subcommands of gonio-bench that belong to the accuracy suite.
#pragma once

namespace CLI {
class App;
}

namespace gonio::accuracy {

// Adds `accuracy`. It runs when the command line is parsed; errors are exceptions.
void add_commands(CLI::App& app);

}  // namespace gonio::accuracy
