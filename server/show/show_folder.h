// The folder of shows that clients save to and open from (`goniod --shows`). A show NAME is its file NAME.json: what
// protocol/schema/saved.proto says, as the state file has it. A name is no path: it cannot leave the folder. Takes as
// long as the disk; any thread.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "ies/core/result.h"
#include "protocol/schema/messages.h"

namespace gonio {

inline constexpr std::size_t kMaxShowName = 100;                      // bytes
inline constexpr std::size_t kMostShows = 1000;                       // that are listed; more are counted
inline constexpr std::size_t kMaxShownBytes = std::size_t{48} << 20;  // of a text that is sent to a client

// Result: the name without ".json" at its end. Errors: "invalid_argument" with `field` as place, where it is empty, too
// long, no UTF-8, or could be a path or a hidden file.
Result<std::string> checked_show_name(std::string_view name, const std::string& field);

// Result: the shows by name, of regular files alone; none where there is no folder yet. Errors: "file_unreadable".
Result<v1::Shows> list_shows(const std::string& folder);

// Writes the file whole or not at all; makes the folder where it is missing. Without `replace` a file that is there
// stays. Errors: "already_exists", "file_unwritable" with the file and the system's reason, "too_large".
Result<bool> write_show_file(const std::string& folder, const std::string& name, const std::string& json, bool replace);

// Errors: "not_found", "already_exists", "file_unwritable".
Result<bool> rename_show_file(const std::string& folder, const std::string& name, const std::string& new_name);
// Errors: "not_found", "file_unwritable".
Result<bool> remove_show_file(const std::string& folder, const std::string& name);

// Result: the text, at most most_bytes of it. Errors: "not_found", "file_unreadable", "too_large".
Result<std::string> read_show_file(const std::string& folder, const std::string& name, std::size_t most_bytes);

}  // namespace gonio
