// How much memory the process may still take.
#pragma once

#include <cstddef>
#include <string>

namespace gonio {

// Result: bytes, the least of what most_bytes (0: no bound) leaves of the process's resident size, its cgroups'
// memory.max (versions 1 and 2, with those above them), RLIMIT_AS, and what the kernel says is available (proc(5),
// MemAvailable). What cannot be read bounds nothing. proc, cgroups: where the kernel's files are. Any thread.
std::size_t memory_room(std::size_t most_bytes, const std::string& proc = "/proc",
                        const std::string& cgroups = "/sys/fs/cgroup");

}  // namespace gonio
