// The subcommands of gonio-bench that belong to the accuracy suite.
#pragma once

namespace CLI {
class App;
}

namespace gonio::accuracy {

// Adds `accuracy` and `crosscheck`. They run when the command line is parsed; errors, and differences beyond
// the tolerance, are exceptions.
void add_commands(CLI::App& app);

}  // namespace gonio::accuracy
