// The words of a `gonio` command that changes the scene -> a Command; used by the CLI and by JOB.json alike.
// Here degrees become radians and "x,y,z" becomes a vector. What is a number is passed on as it is, also nan: the
// server decides what it accepts.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "ies/core/result.h"
#include "protocol/schema/messages.h"
#include "protocol/schema/word_table.h"

namespace gonio {

// Result: the commands that change the scene, meter and capture.
std::span<const WordCommand> scene_commands();

// words: e.g. {"set", "light", "key", "--level", "0.5"}; where the first word begins no command, "set" is understood;
// --base-rev N goes with each. Errors: "usage".
Result<v1::Command> command_from_words(std::span<const std::string> words);

// Result: "png", "jpg" or "exr" by the file's name; nothing for other names.
std::optional<std::string> capture_format(const std::string& file);
// Result: likewise the format of a scene's file: "glb" or "mvr".
std::optional<std::string> scene_format(const std::string& file);

// If the command names a profile that is a file here, puts the file's content into the command (at most one byte more
// than the 1 MiB that servers accept). Result: whether it did. Errors: "file_unreadable".
Result<bool> attach_profile_file(v1::Command& command);

// Whole text -> number; locale-independent; "nan" and "inf" are numbers.
std::optional<double> parse_number(std::string_view text);
std::optional<std::uint32_t> parse_count(std::string_view text);
// "1,2,3" -> numbers; how many there must be is the server's business.
std::optional<std::vector<double>> parse_vector(std::string_view text);
// "800x600" -> width, height.
std::optional<std::pair<std::uint32_t, std::uint32_t>> parse_size(std::string_view text);

}  // namespace gonio
