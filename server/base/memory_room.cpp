#include "server/base/memory_room.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <sstream>

namespace gonio {
namespace {

constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

std::optional<std::size_t> number_in(const std::filesystem::path& file) {
    std::ifstream in(file);
    std::uint64_t value = 0;
    return in >> value ? std::optional<std::size_t>(value) : std::nullopt;  // "max": none
}

// Result: the number behind a word at the beginning of a line.
std::optional<std::size_t> entry_in(const std::filesystem::path& file, const std::string& word) {
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);) {
        std::istringstream text(line);
        std::string first;
        std::uint64_t value = 0;
        if (text >> first >> value && first == word) return value;
    }
    return std::nullopt;
}

// Of a cgroup and those above it. What the kernel would give back of cached files counts as room.
std::size_t room_in_cgroups(std::filesystem::path folder, const std::filesystem::path& top, const char* most,
                            const char* used, const char* cached) {
    std::size_t room = kNone;
    if (!folder.string().starts_with(top.string())) folder = top;  // outside of what is mounted
    for (;; folder = folder.parent_path()) {
        const auto limit = number_in(folder / most), taken = number_in(folder / used);
        if (limit && taken) {
            const std::size_t back = entry_in(folder / "memory.stat", cached).value_or(0),
                              kept = *taken - std::min(*taken, back);
            room = std::min(room, *limit > kept ? *limit - kept : 0);
        }
        if (folder == top || !folder.has_relative_path()) return room;
    }
}

}  // namespace

std::size_t memory_room(std::size_t most_bytes, const std::string& proc, const std::string& cgroups) {
    std::size_t room = kNone;
    const auto bound = [&](std::size_t bytes) { room = std::min(room, bytes); };
    if (const auto available = entry_in(proc + "/meminfo", "MemAvailable:")) bound(*available * 1024);
    std::size_t virtual_pages = 0, resident_pages = 0;
    std::ifstream(proc + "/self/statm") >> virtual_pages >> resident_pages;
    const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
    const auto left = [](std::size_t most, std::size_t used) { return most > used ? most - used : 0; };
    if (most_bytes > 0) bound(left(most_bytes, resident_pages * page));
    rlimit address_space{};
    if (::getrlimit(RLIMIT_AS, &address_space) == 0 && address_space.rlim_cur != RLIM_INFINITY)
        bound(left(address_space.rlim_cur, virtual_pages * page));
    std::ifstream own(proc + "/self/cgroup");
    for (std::string line; std::getline(own, line);) {
        // "0::/path" (version 2), or "N:controllers:/path".
        const std::size_t first = line.find(':'), second = line.find(':', first + 1);
        if (second == std::string::npos) continue;
        const std::string controllers = line.substr(first + 1, second - first - 1), path = line.substr(second + 1);
        const std::filesystem::path top(cgroups), below = path.substr(std::min<std::size_t>(path.size(), 1));
        if (controllers.empty())
            bound(room_in_cgroups((top / below).lexically_normal(), top, "memory.max", "memory.current",
                                  "inactive_file"));
        else if ((',' + controllers + ',').find(",memory,") != std::string::npos)
            bound(room_in_cgroups((top / "memory" / below).lexically_normal(), top, "memory.limit_in_bytes",
                                  "memory.usage_in_bytes", "total_inactive_file"));
    }
    return room;
}

}  // namespace gonio
