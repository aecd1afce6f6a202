// goniod wired together: loader, render, encode and net threads, and what passes between them.
#pragma once

#include "server/app/options.h"

namespace gonio {

// Runs until SIGINT or SIGTERM. Result: the exit code (0 ok, 2 bad option or scene). Throws std::runtime_error with one
// sentence where the environment is broken (no GL, port taken).
int run_daemon(const Options& options);

}  // namespace gonio
