// The commands of gonio: the rows that their words are read by, and what each does with the server.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "client/cli/session.h"
#include "ies/core/result.h"
#include "protocol/schema/word_table.h"

namespace gonio {

// Result: every command of gonio, in the order of help.
std::span<const WordCommand> cli_commands();
// Result: the options that go with every command, before or after it.
std::span<const WordRow> cli_options();
// Result: what a command line says; faults are in it.
ReadWords read_command_line(std::span<const std::string> args);
// Result: the options of the command that the words begin with. Of "set" and other first words of two: their commands.
// Else: every command, a line each, and the options of all.
std::string help_text(const ReadWords& words);

// Result: the commands and options as JSON, one line: packaging/option_texts.py makes man page and completions of it.
std::string dump_words();

// Writes beside the target and renames, so that nobody ever reads half a file. Errors: "file_unwritable".
Result<bool> write_atomically(const std::filesystem::path& path, const std::string& bytes);
// Result: what --frames says; 0: it is not there. Errors: "usage" of a 0 that is.
Result<std::uint32_t> frames_wanted(const ReadWords& words);

// Does what the words say; they have no fault. Result: the exit code.
int run_command(const Session& session, const ReadWords& words);

// `gonio control`: the lease of the camera, held for --hold seconds or until the program is interrupted; or the end of
// whoever's lease. Result: the exit code.
int control(const Session& session, const ReadWords& words);

// `gonio watch`: prints a line for each change and frame. Result: the exit code.
int watch(const Session& session, const ReadWords& words);

// `gonio relay`: passes the pictures on as RTP or as a byte stream, until it is interrupted. Result: the exit code.
int relay(const Session& session, const ReadWords& words);

}  // namespace gonio
