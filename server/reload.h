// What SIGHUP does: certificate, token files and log level are read again, file and environment with them.
#pragma once

#include "server/net/front.h"
#include "server/options.h"

namespace gonio {

// Whatever cannot be read stays as it is, and the log says so. Any thread.
void reload(const Options& options, Front& front);

void set_log_level(const Options& options);

}  // namespace gonio
