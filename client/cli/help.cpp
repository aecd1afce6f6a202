#include <algorithm>
#include <vector>

#include "client/cli/commands.h"
#include "client/cli/table.h"

namespace gonio {
namespace {

using Lines = std::vector<Cells>;  // of two cells, the left one with its indent

std::string with_value(const WordRow& row) {
    return std::string(row.name) + (row.metavar.empty() ? "" : " " + std::string(row.metavar));
}

// Result: the command with what it needs: "add light NAME --profile FILE".
std::string synopsis(const WordCommand& command) {
    std::string text(command.name);
    for (const WordRow& row : command.names) text += " " + std::string(row.name);
    for (const WordRow& row : command.options)
        if (std::find(std::begin(command.needs), std::end(command.needs), row.name) != std::end(command.needs))
            text += " " + with_value(row);
    return text;
}

void add_rows(Lines& lines, std::span<const WordRow> rows) {
    for (const WordRow& row : rows)
        lines.push_back({"  " + with_value(row),
                         std::string(row.form == WordForm::degrees ? "degrees, " : "") + std::string(row.help)});
}

std::string command_help(const WordCommand& command) {
    Lines lines;
    add_rows(lines, command.names);
    add_rows(lines, command.options);
    if (command.message.starts_with("command.")) add_rows(lines, change_options());
    return "usage: gonio " + synopsis(command) + (command.options.empty() ? "" : " [options]") + "\n\n" +
           std::string(command.help) + "\n\n" + aligned(lines);
}

std::string command_list(const std::string& group) {
    Lines lines;
    for (const WordCommand& command : cli_commands())
        if (group.empty() || command.name.starts_with(group + " "))
            lines.push_back({"  " + synopsis(command), std::string(command.help)});
    return aligned(lines);
}

}  // namespace

std::string help_text(const ReadWords& words) {
    if (words.command) return command_help(*words.command);
    if (!words.group.empty()) return command_list(words.group);
    Lines options;
    add_rows(options, cli_options());
    return "usage: gonio [options] COMMAND\n\n"
           "Talks to a running goniod. gonio COMMAND --help prints the options of a command.\n"
           "Angles are degrees, all else is SI; a vector is written x,y,z (world, +Y up).\n\n" +
           command_list("") + "\nOptions, before or after the command:\n" + aligned(options) +
           "\nEvery change prints the scene_rev that contains it.\n"
           "exit codes: 0 ok, 1 refused by the server, 2 usage, 3 unreachable\n";
}

}  // namespace gonio
