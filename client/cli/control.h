// `gonio control`: the lease of the camera, held as long as the command runs.
#pragma once

#include <optional>
#include <ostream>
#include <span>
#include <string>

#include "client/cli/transport.h"

namespace gonio {

// words: "acquire [--take] [--hold S]": holds it for S seconds, without --hold until the program is interrupted;
// "release [--take]": ends the lease of whoever has it, another's with --take only. Result: why it was not carried out:
// "usage", what the server refuses ("held", "permission"), "unreachable".
std::optional<Error> run_control(const ServerAddress& address, const Connection::Wanted& wanted,
                                 std::span<const std::string> words, std::ostream& out);

}  // namespace gonio
