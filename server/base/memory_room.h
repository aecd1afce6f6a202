// How much memory the process may still take.
#pragma once

#include <cstddef>
#include <string>

namespace gonio {

// Result: bytes, the least of four bounds. The first is what most_bytes (0: no bound) leaves beside the process's
// resident size. The second is what its cgroups' memory.max leaves (versions 1 and 2, with those above them). The third
// is what RLIMIT_AS leaves. The fourth is what the kernel says is available (proc(5), MemAvailable). What cannot be
// read bounds nothing. proc, cgroups: where the kernel's files are. Any thread.
std::size_t memory_room(std::size_t most_bytes, const std::string& proc = "/proc",
                        const std::string& cgroups = "/sys/fs/cgroup");

}  // namespace gonio
