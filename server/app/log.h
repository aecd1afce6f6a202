// The log: lines on standard error, as text or as JSON (--log, docs/operations.md). An entry is one line: names that it
// quotes come from anybody, and of their control characters text has '?'.
#pragma once

#include <string>

#include "server/app/options.h"

namespace gonio {

// Result: an entry as --log json writes it, one line without its end: {"time","level","message"}. time_ms: since 1970,
// UTC. What is no UTF-8 is replaced.
std::string log_line_json(long long time_ms, const std::string& level, const std::string& message);

// Before the first entry.
void start_log(const Options& options);
void set_log_level(const std::string& level);  // of --log-level
// Says why the program ends, whatever --log-level is: one sentence.
void log_end(const Options& options, const std::string& why);

}  // namespace gonio
