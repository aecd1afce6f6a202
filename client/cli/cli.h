// `gonio`: words -> messages -> text. Exit codes: 0 ok, 1 refused by the server, 2 usage, 3 unreachable.
#pragma once

#include <iosfwd>
#include <span>
#include <string>

namespace gonio {

inline constexpr int kExitOk = 0, kExitRefused = 1, kExitUsage = 2, kExitUnreachable = 3;

// args: without the program's name. Result: the exit code.
int run_cli(std::span<const std::string> args, std::ostream& out, std::ostream& err);

}  // namespace gonio
