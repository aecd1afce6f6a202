// `gonio control`: the lease of the camera, held as long as the command runs.
#pragma once

#include <optional>
#include <ostream>

#include "client/cli/transport.h"
#include "protocol/schema/word_table.h"

namespace gonio {

// words: "control acquire": holds it for --hold seconds, without --hold until the program is interrupted; "control
// release": ends the lease of whoever has it. --take: also another's. Result: why it was not carried out: "usage", what
// the server refuses ("held", "permission"), "unreachable".
std::optional<Error> run_control(const ServerAddress& address, const Connection::Wanted& wanted, const ReadWords& words,
                                 std::ostream& out);

}  // namespace gonio
